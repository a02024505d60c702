//! NUMERICS §5: `velocity_add`, `position_advance`, `position_from_kept`.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::memory::{BLOCK, FieldView, LANES, VectorField, lanes_mut};

/// to += scale from.
pub(crate) fn add<T: Real>(
    from: &VectorField<T>,
    scale: f64,
    to: &mut VectorField<T>,
    arch: pulp::Arch,
) {
    let (from, scale) = (FieldView::new(from), T::from_f64(scale));
    to.chunks_mut(BLOCK).enumerate().for_each(|(block, to)| {
        arch.dispatch(AddTask { from, scale, block, to });
    });
}

/// One block, compiled for each instruction set.
struct AddTask<'a, 'b, T> {
    from: FieldView<'a, T>,
    scale: T,
    block: usize,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for AddTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for local in (0..self.to[0].len()).step_by(LANES) {
            let from = self.from.packet((self.block * BLOCK + local) as isize);
            for axis in 0..3 {
                let to = lanes_mut(self.to[axis], local);
                for lane in 0..LANES {
                    to[lane] += self.scale * from[axis][lane];
                }
            }
        }
    }
}
