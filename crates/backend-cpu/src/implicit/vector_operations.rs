//! `vector_dot` and `vector_combine`, by blocks.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::memory::{BLOCK, FieldView, LANES, VectorField, lanes, lanes_mut};

/// Scalar product of two fields of `count` particles, in blocks, the blocks summed in order.
pub(super) fn dot<T: Real>(
    a: &VectorField<T>,
    b: &VectorField<T>,
    partials: &mut [[f64; 2]],
    arch: pulp::Arch,
) -> f64 {
    let (a, b) = (FieldView::new(a), FieldView::new(b));
    partials.par_iter_mut().enumerate().for_each(|(block, partial)| {
        partial[0] = arch.dispatch(DotTask { a, b, block });
    });
    partials.iter().map(|partial| partial[0]).sum()
}

/// to = from_scale from + to_scale to; a scale of zero drops its field.
pub(super) fn combine<T: Real>(
    (from_scale, from): (f64, Option<&VectorField<T>>),
    to_scale: f64,
    to: &mut VectorField<T>,
    arch: pulp::Arch,
) {
    let from = from.filter(|_| from_scale != 0.0).map(FieldView::new);
    let scales = (T::from_f64(from_scale), T::from_f64(to_scale));
    to.chunks_mut(BLOCK).enumerate().for_each(|(block, to)| {
        arch.dispatch(CombineTask { from, scales, block, to });
    });
}

struct DotTask<'a, T> {
    a: FieldView<'a, T>,
    b: FieldView<'a, T>,
    block: usize,
}

impl<T: Real> NullaryFnOnce for DotTask<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let mut sum = Dot::new();
        let first = self.block * BLOCK;
        let length = (self.a.len() - first).min(BLOCK);
        for local in (0..length).step_by(LANES) {
            let at = (first + local) as isize;
            sum.add(self.a.packet(at), self.b.packet(at));
        }
        sum.total()
    }
}

struct CombineTask<'a, 'b, T> {
    from: Option<FieldView<'a, T>>,
    scales: (T, T),
    block: usize,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for CombineTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (from_scale, to_scale) = self.scales;
        for local in (0..self.to[0].len()).step_by(LANES) {
            let from = self.from.map(|from| from.packet((self.block * BLOCK + local) as isize));
            for axis in 0..3 {
                let to = lanes_mut(self.to[axis], local);
                for lane in 0..LANES {
                    let kept = if to_scale == T::ZERO { T::ZERO } else { to_scale * to[lane] };
                    to[lane] = match from {
                        Some(from) if to_scale == T::ZERO => from_scale * from[axis][lane],
                        Some(from) => from_scale * from[axis][lane] + kept,
                        None => kept,
                    };
                }
            }
        }
    }
}

/// A scalar product in progress: one sum for each lane, over packets and axes in order.
pub(super) struct Dot<T> {
    lanes: [T; LANES],
}

impl<T: Real> Dot<T> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { lanes: [T::ZERO; LANES] }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, a: [&[T; LANES]; 3], b: [&[T; LANES]; 3]) {
        for axis in 0..3 {
            for lane in 0..LANES {
                self.lanes[lane] += a[axis][lane] * b[axis][lane];
            }
        }
    }

    /// Adds a block of two fields, the second one given as a chunk.
    #[inline(always)]
    pub(super) fn add_block(&mut self, a: FieldView<'_, T>, first: usize, b: &[&mut [T]; 3]) {
        for local in (0..b[0].len()).step_by(LANES) {
            let b = b.each_ref().map(|values| lanes(values, local));
            self.add(a.packet((first + local) as isize), b);
        }
    }

    /// Adds a block of two chunks.
    #[inline(always)]
    pub(super) fn add_chunks(&mut self, a: &[&mut [T]; 3], b: &[&mut [T]; 3]) {
        for local in (0..b[0].len()).step_by(LANES) {
            let b = b.each_ref().map(|values| lanes(values, local));
            self.add(a.each_ref().map(|values| lanes(values, local)), b);
        }
    }

    /// The sum of the lanes in order, in double precision.
    #[inline(always)]
    pub(super) fn total(&self) -> f64 {
        let mut total = 0.0;
        for lane in 0..LANES {
            total += self.lanes[lane].to_f64();
        }
        total
    }
}
