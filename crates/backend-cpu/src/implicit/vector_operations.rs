//! `vector_dot` and `vector_combine`, by blocks.

use cloth_core::{Real, stepper::linear::block_sum};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::memory::{BLOCK, FieldView, LANES, VectorField, lanes, lanes_mut};

/// Scalar product of two fields, block by block.
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
    block_sum(partials.iter().map(|partial| partial[0]))
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
        let first = self.block * BLOCK;
        let length = (self.a.len() - first).min(BLOCK);
        block_dot(self.a.range(first as isize, length), self.b.range(first as isize, length))
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

/// Particles of a part of a block.
const PART: usize = BLOCK / 4;

/// The scalar product of two runs of as many particles, whole packets and at most a block. Each lane adds up the
/// particles of a part, pairs of packets first; lanes and parts are added as trees, in double precision.
#[inline(always)]
pub(super) fn block_dot<T: Real>(a: [&[T]; 3], b: [&[T]; 3]) -> f64 {
    let length = b[0].len();
    let mut parts = [0.0; BLOCK / PART];
    for (number, part) in parts.iter_mut().enumerate() {
        let mut sum = [T::ZERO; LANES];
        let end = length.min((number + 1) * PART);
        let mut local = number * PART;
        while local < end {
            let mut pair = products(a, b, local);
            if local + LANES < end {
                let second = products(a, b, local + LANES);
                for lane in 0..LANES {
                    pair[lane] += second[lane];
                }
            }
            for lane in 0..LANES {
                sum[lane] += pair[lane];
            }
            local += 2 * LANES;
        }
        *part = lanes_sum(&sum);
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}

/// The products of the packet at `local`, in each lane their sum.
#[inline(always)]
fn products<T: Real>(a: [&[T]; 3], b: [&[T]; 3], local: usize) -> [T; LANES] {
    let [ax, ay, az] = [lanes(a[0], local), lanes(a[1], local), lanes(a[2], local)];
    let [bx, by, bz] = [lanes(b[0], local), lanes(b[1], local), lanes(b[2], local)];
    let mut products = [T::ZERO; LANES];
    for lane in 0..LANES {
        products[lane] = ax[lane] * bx[lane] + ay[lane] * by[lane] + az[lane] * bz[lane];
    }
    products
}

/// The sum of the lanes: the second half is added to the first until one is left.
#[inline(always)]
fn lanes_sum<T: Real>(lanes: &[T; LANES]) -> f64 {
    let mut sums = [0.0; LANES];
    for lane in 0..LANES {
        sums[lane] = lanes[lane].to_f64();
    }
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            sums[lane] += sums[lane + half];
        }
        half /= 2;
    }
    sums[0]
}
