//! How far particles have moved since the list of pairs was made.

use crate::Real;

/// Numbers that a device finds for each block of particles.
pub const MOVED_NUMBERS: usize = 14;

/// What rounding may do to the proof, relative to the reach of the list.
const ROUNDING: f64 = 1e-3;

/// Largest numbers over all particles: ways since the first set of positions, their negatives, the same of the second set, the largest coordinate, and
/// whether something is not finite.
#[derive(Clone, Copy, Debug)]
pub struct Moved<T>([T; MOVED_NUMBERS]);

impl<T: Real> Moved<T> {
    /// Of the results of all blocks.
    #[must_use]
    pub fn of(numbers: &[T]) -> Self {
        let mut all = [-T::INFINITY; MOVED_NUMBERS];
        for block in numbers.chunks_exact(MOVED_NUMBERS) {
            for (all, &number) in all.iter_mut().zip(block) {
                *all = all.maximum(number);
            }
        }
        Self(all)
    }

    /// Whether all numbers were finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.0[13] == T::ZERO
    }

    /// The largest coordinate \[m\].
    #[must_use]
    pub const fn largest(&self) -> T {
        self.0[12]
    }

    /// Whether a list, without pairs that are `reach` apart along the same axis at both sets, has every pair whose features are `distance` or less apart
    /// along all axes now.
    ///
    /// A pair that is missing was `reach` apart along an axis at both sets of positions. Say that since one of these all particles have moved by
    /// c, and each by at most e along each axis beside that: it is reach - 2 e apart.
    #[must_use]
    pub fn holds(&self, reach: T, distance: T) -> bool {
        let room = (T::ONE - T::from_f64(ROUNDING)) * reach - distance;
        let wide = |set: usize| {
            let side = |k: usize| self.0[6 * set + k] + self.0[6 * set + 3 + k];
            side(0).maximum(side(1)).maximum(side(2))
        };
        wide(0) <= room || wide(1) <= room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of one block in which all particles went from 0 by between `low` and `high` along x.
    fn moved(low: f32, high: f32) -> Moved<f32> {
        let way = [high, 0.0, 0.0, -low, 0.0, 0.0];
        let mut numbers = [0.0; MOVED_NUMBERS];
        numbers[..6].copy_from_slice(&way);
        numbers[6..12].copy_from_slice(&way);
        Moved::of(&numbers)
    }

    #[test]
    fn a_list_holds_for_a_common_motion_but_not_for_particles_that_come_closer() {
        let (reach, distance) = (0.02, 0.01);
        assert!(moved(5.0, 5.009).holds(reach, distance));
        assert!(!moved(5.0, 5.011).holds(reach, distance));
        assert!(moved(-0.004, 0.004).holds(reach, distance));
        assert!(!moved(-0.006, 0.006).holds(reach, distance));
    }
}
