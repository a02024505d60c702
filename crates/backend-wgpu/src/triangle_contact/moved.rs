//! How far particles have moved since the list of pairs was made.

/// Words of the result of a workgroup of `contact_pairs_moved.wgsl`.
pub(crate) const MOVED_WORDS: usize = 16;

/// What rounding may do to the proof, relative to the reach of the list.
const ROUNDING: f32 = 1e-3;

/// Largest numbers over all particles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moved([f32; MOVED_WORDS]);

impl Moved {
    /// Of the results of all workgroups.
    pub(crate) fn of(words: &[u32]) -> Self {
        let mut all = [f32::NEG_INFINITY; MOVED_WORDS];
        for block in words.chunks_exact(MOVED_WORDS) {
            for (all, &word) in all.iter_mut().zip(block) {
                *all = all.max(f32::from_bits(word));
            }
        }
        Self(all)
    }

    /// Whether all numbers were finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.0[14] == 0.0
    }

    /// The largest coordinate \[m\].
    pub(crate) const fn largest(&self) -> f32 {
        self.0[13]
    }

    /// The centre of the box around all ways since the first set of positions \[m\].
    pub(crate) fn centre(&self) -> [f32; 3] {
        std::array::from_fn(|k| 0.5 * (self.0[k] - self.0[3 + k]))
    }

    /// Whether a list of all pairs closer than `reach` at both sets has every pair whose features are `distance` or less apart along
    /// all axes now.
    ///
    /// A pair that is missing was `reach` apart along an axis at both sets of positions, and between these. Say that since one of
    /// these all particles have moved by c, and each by at most e along each axis beside that: it is reach - 2 e apart. So
    /// is it if each is e away from the box around its two places.
    pub(crate) fn holds(&self, reach: f32, distance: f32) -> bool {
        let room = (1.0 - ROUNDING) * reach - distance;
        let wide = |set: usize| {
            (0..3).map(|k| self.0[6 * set + k] + self.0[6 * set + 3 + k]).fold(0.0, f32::max)
        };
        wide(0) <= room || wide(1) <= room || 2.0 * self.0[12] <= room
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of one workgroup in which all particles went from 0 by between `low` and `high` along x.
    fn moved(low: f32, high: f32) -> Moved {
        let outside = high.max(-low).max(0.0);
        let way = [high, 0.0, 0.0, -low, 0.0, 0.0];
        let mut numbers = [0.0; MOVED_WORDS];
        numbers[..6].copy_from_slice(&way);
        numbers[6..12].copy_from_slice(&way);
        numbers[12] = outside;
        Moved::of(&numbers.map(f32::to_bits))
    }

    #[test]
    fn a_list_holds_for_a_common_motion_but_not_for_particles_that_come_closer() {
        let (reach, distance) = (0.02, 0.01);
        assert!(moved(5.0, 5.009).holds(reach, distance));
        assert!(!moved(5.0, 5.011).holds(reach, distance));
        assert!(moved(-0.004, 0.004).holds(reach, distance));
        assert!(!moved(-0.006, 0.006).holds(reach, distance));
        assert!((moved(1.0, 3.0).centre()[0] - 2.0).abs() < 1e-6);
    }
}
