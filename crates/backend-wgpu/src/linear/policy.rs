//! How many iterations and solves are recorded for a substep.

use cloth_core::LinearSettings;

use crate::layout::{INVALID_ITERATIONS, INVALID_PASSES, Solve};

/// Solves of a substep whose iterations are counted apart.
const PLACES: usize = 4;
/// Iterations recorded before anything is known.
const ITERATIONS_FIRST: u32 = 48;
/// Solves of a substep recorded before anything is known, where colliders may ask for several.
const PASSES_FIRST: u32 = 2;
/// Frames that did not need the last recorded solve, after which it is left out.
const PATIENCE: u32 = 8;

/// What the host records.
#[derive(Debug)]
pub(crate) struct SolvePolicy {
    iterations_max: u32,
    iterations: [u32; PLACES],
    passes_max: u32,
    passes: u32,
    unused_frames: u32,
}

impl SolvePolicy {
    /// For solves with these settings for so many particles, `passes_max` of them in a substep at most.
    pub(crate) fn new(linear: &LinearSettings, particles: usize, passes_max: u32) -> Self {
        let iterations_max = linear.iterations_max;
        let first = if linear.tolerance == 0.0 {
            iterations_max
        } else {
            // Without rounding conjugate gradients take no more than there are unknowns.
            let unknowns = u32::try_from(3 * particles).unwrap_or(u32::MAX);
            ITERATIONS_FIRST.min(unknowns).min(iterations_max)
        };
        Self {
            iterations_max,
            iterations: [first; PLACES],
            passes_max,
            passes: PASSES_FIRST.min(passes_max),
            unused_frames: 0,
        }
    }

    /// Iterations of the solve with this number in its substep.
    pub(crate) fn iterations(&self, pass: u32) -> u32 {
        self.iterations[(pass as usize).min(PLACES - 1)]
    }

    /// Solves of a substep.
    pub(crate) const fn passes(&self) -> u32 {
        self.passes
    }

    /// Whether the device asked for more than was recorded; there is more then.
    pub(crate) fn grow(&mut self, invalid: u32) -> bool {
        if invalid & INVALID_ITERATIONS != 0 {
            self.iterations = self.iterations.map(|count| (2 * count).min(self.iterations_max));
        }
        if invalid & INVALID_PASSES != 0 {
            self.passes = (self.passes + 1).min(self.passes_max);
            self.unused_frames = 0;
        }
        invalid & (INVALID_ITERATIONS | INVALID_PASSES) != 0
    }

    /// A frame was good and did this.
    pub(crate) fn frame_was_good(&mut self, solve: &Solve) {
        for (recorded, used) in self.iterations.iter_mut().zip(solve.iterations_most) {
            if used > 0 {
                // Some more than were needed, as the next frame may need some more.
                let wanted = (used + used / 4 + 4).min(self.iterations_max);
                *recorded = wanted.max(*recorded - *recorded / 4);
            }
        }
        let last = self.passes as usize - 1;
        let is_unused = last > 0 && solve.iterations_most[last.min(PLACES - 1)] == 0;
        self.unused_frames = if is_unused { self.unused_frames + 1 } else { 0 };
        if self.unused_frames >= PATIENCE {
            self.passes -= 1;
            self.unused_frames = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn policy() -> SolvePolicy {
        let linear = LinearSettings { iterations_max: 200, ..LinearSettings::default() };
        SolvePolicy::new(&linear, 1000, 4)
    }

    #[test]
    fn what_is_too_little_grows_to_the_cap() {
        let mut policy = policy();
        assert!(!policy.grow(0));
        for expected in [96, 192, 200, 200] {
            assert!(policy.grow(INVALID_ITERATIONS));
            assert_eq!(policy.iterations(0), expected);
        }
        for expected in [3, 4, 4] {
            assert!(policy.grow(INVALID_PASSES));
            assert_eq!(policy.passes(), expected);
        }
    }

    #[test]
    fn what_is_too_much_shrinks_but_not_below_what_is_used() {
        let mut policy = policy();
        let solve = Solve { iterations_most: [16, 0, 0, 0], ..Solve::default() };
        for _ in 0..40 {
            policy.frame_was_good(&solve);
        }
        assert_eq!((policy.iterations(0), policy.passes()), (24, 1));
    }

    #[test]
    fn a_number_of_iterations_that_is_asked_for_is_recorded() {
        let linear =
            LinearSettings { iterations_max: 300, tolerance: 0.0, ..LinearSettings::default() };
        assert_eq!(SolvePolicy::new(&linear, 1000, 4).iterations(0), 300);
    }
}
