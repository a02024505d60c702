//! NUMERICS §5: the filter S, `constraint_filter` and `constraint_project`.

use cloth_core::Real;

use super::constraints::Constraints;
use crate::memory::{BLOCK, FieldView, LANES, Masses, lanes, lanes_mut};

/// S: zero for held particles, a projector for constrained ones.
#[derive(Clone, Copy)]
pub(super) struct Filter<'a, T> {
    pub(super) masses: &'a Masses<T>,
    pub(super) constraints: &'a Constraints<T>,
}

impl<T: Real> Filter<'_, T> {
    /// Filters a block.
    #[inline(always)]
    pub(super) fn apply(&self, block: usize, chunk: &mut [&mut [T]; 3]) {
        self.hold(block, chunk);
        for constraint in self.constraints.block(block) {
            let local = constraint.particle() - block * BLOCK;
            let filtered = constraint.apply(chunk.each_ref().map(|values| values[local]));
            for axis in 0..3 {
                chunk[axis][local] = filtered[axis];
            }
        }
    }

    /// Filters a block, and adds z for particles with these velocities.
    pub(super) fn project(
        &self,
        block: usize,
        velocity: FieldView<'_, T>,
        chunk: &mut [&mut [T]; 3],
    ) {
        self.hold(block, chunk);
        for constraint in self.constraints.block(block) {
            let local = constraint.particle() - block * BLOCK;
            let projected = constraint.project(
                chunk.each_ref().map(|values| values[local]),
                velocity.get(constraint.particle()),
            );
            for axis in 0..3 {
                chunk[axis][local] = projected[axis];
            }
        }
    }

    #[inline(always)]
    fn hold(&self, block: usize, chunk: &mut [&mut [T]; 3]) {
        for local in (0..chunk[0].len()).step_by(LANES) {
            let inverse = lanes(&self.masses.inverse, block * BLOCK + local);
            for axis in 0..3 {
                let values = lanes_mut(chunk[axis], local);
                for lane in 0..LANES {
                    values[lane] = if inverse[lane] > T::ZERO { values[lane] } else { T::ZERO };
                }
            }
        }
    }
}
