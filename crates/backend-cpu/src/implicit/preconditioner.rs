//! NUMERICS §5, `preconditioner_build` and `preconditioner_apply`: diagonal and 3 x 3 blocks.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    constraints::Constraints,
    matrix::{BlockField, Symmetric},
};
use crate::memory::{BLOCK, FieldView, LANES, Lanes, VectorField, lanes_mut};

/// Inverts the diagonal of D, or with `blocks` D itself, for every particle.
pub(super) fn build<T: Real>(
    diagonal: &BlockField<T>,
    constraints: &Constraints<T>,
    blocks: bool,
    inverse: &mut BlockField<T>,
    count: usize,
    arch: pulp::Arch,
) {
    if blocks {
        let off = inverse.off_diagonal.get_or_insert_with(|| VectorField::new(count, 0));
        inverse.diagonal.chunks_mut(BLOCK).zip(off.chunks_mut(BLOCK)).enumerate().for_each(
            |(block, (on, off))| {
                arch.dispatch(InverseTask { source: diagonal, start: block * BLOCK, on, off });
            },
        );
    } else {
        inverse.off_diagonal = None;
        let source = FieldView::new(&diagonal.diagonal);
        inverse.diagonal.chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
            for local in (0..chunk[0].len()).step_by(LANES) {
                let packet = source.packet((block * BLOCK + local) as isize);
                for axis in 0..3 {
                    let out = lanes_mut(chunk[axis], local);
                    for lane in 0..LANES {
                        out[lane] = reciprocal(packet[axis][lane]);
                    }
                }
            }
        });
    }
    for constraint in constraints.iter() {
        let block = diagonal.get(constraint.particle());
        let within = restrict(&block, &constraint.filter());
        let inverted = if blocks {
            invert(within)
        } else {
            let [xx, yy, zz, ..] = within;
            [reciprocal(xx), reciprocal(yy), reciprocal(zz), T::ZERO, T::ZERO, T::ZERO]
        };
        inverse.set(constraint.particle(), inverted);
    }
}

/// P^-1 of a packet, before any filter.
#[inline(always)]
pub(super) fn packet<T: Real>(
    inverse: &BlockField<T>,
    first: usize,
    [x, y, z]: [&Lanes<T>; 3],
) -> [Lanes<T>; 3] {
    let [xx, yy, zz] = FieldView::new(&inverse.diagonal).packet(first as isize);
    let mut out = [[T::ZERO; LANES]; 3];
    if let Some(off) = &inverse.off_diagonal {
        let [xy, xz, yz] = FieldView::new(off).packet(first as isize);
        for lane in 0..LANES {
            out[0][lane] = xx[lane] * x[lane] + xy[lane] * y[lane] + xz[lane] * z[lane];
            out[1][lane] = xy[lane] * x[lane] + yy[lane] * y[lane] + yz[lane] * z[lane];
            out[2][lane] = xz[lane] * x[lane] + yz[lane] * y[lane] + zz[lane] * z[lane];
        }
    } else {
        for lane in 0..LANES {
            out[0][lane] = xx[lane] * x[lane];
            out[1][lane] = yy[lane] * y[lane];
            out[2][lane] = zz[lane] * z[lane];
        }
    }
    out
}

/// One block of inverses, compiled for each instruction set.
struct InverseTask<'a, 'b, T> {
    source: &'a BlockField<T>,
    start: usize,
    on: [&'b mut [T]; 3],
    off: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for InverseTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let zeros = [T::ZERO; LANES];
        let on = FieldView::new(&self.source.diagonal);
        for local in (0..self.on[0].len()).step_by(LANES) {
            let first = (self.start + local) as isize;
            let [xx, yy, zz] = on.packet(first);
            let [xy, xz, yz] = match &self.source.off_diagonal {
                Some(field) => FieldView::new(field).packet(first),
                None => [&zeros; 3],
            };
            let mut inverse = [[T::ZERO; LANES]; 6];
            for lane in 0..LANES {
                let block = [xx[lane], yy[lane], zz[lane], xy[lane], xz[lane], yz[lane]];
                let inverted = invert(block);
                for entry in 0..6 {
                    inverse[entry][lane] = inverted[entry];
                }
            }
            for axis in 0..3 {
                *lanes_mut(self.on[axis], local) = inverse[axis];
                *lanes_mut(self.off[axis], local) = inverse[3 + axis];
            }
        }
    }
}

/// 1/x, or 0 where there is no particle.
#[inline(always)]
fn reciprocal<T: Real>(value: T) -> T {
    if value > T::ZERO { T::ONE / value } else { T::ZERO }
}

/// The inverse of a block, made safe against rounding by 4 eps of its trace. From its Cholesky
/// factors L L^T.
#[inline(always)]
pub(super) fn invert<T: Real>([xx, yy, zz, xy, xz, yz]: Symmetric<T>) -> Symmetric<T> {
    let trace = xx + yy + zz;
    let safety = T::from_f64(4.0) * T::EPSILON * trace;
    // A lane without a particle has trace zero, and must give zeros.
    let floor = safety.maximum(T::from_f64(1e-30));
    let a = (xx + safety).maximum(floor).sqrt();
    let a_inverse = T::ONE / a;
    let b = xy * a_inverse;
    let c = xz * a_inverse;
    let d = (yy + safety - b * b).maximum(floor).sqrt();
    let d_inverse = T::ONE / d;
    let e = (yz - b * c) * d_inverse;
    let f_inverse = T::ONE / (zz + safety - c * c - e * e).maximum(floor).sqrt();
    // Columns of the inverse of L.
    let p = a_inverse;
    let q = -(b * p) * d_inverse;
    let r = -(c * p + e * q) * f_inverse;
    let s = d_inverse;
    let t = -(e * s) * f_inverse;
    let w = f_inverse;
    let exists = if trace > T::ZERO { T::ONE } else { T::ZERO };
    [
        exists * (p * p + q * q + r * r),
        exists * (s * s + t * t),
        exists * (w * w),
        exists * (q * s + r * t),
        exists * (r * w),
        exists * (t * w),
    ]
}

/// S D S + tr(D) (I - S).
pub(super) fn restrict<T: Real>(block: &Symmetric<T>, filter: &Symmetric<T>) -> Symmetric<T> {
    let full = |[xx, yy, zz, xy, xz, yz]: Symmetric<T>| [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let (d, s) = (full(*block), full(*filter));
    let trace = block[0] + block[1] + block[2];
    let product = |a: [[T; 3]; 3], b: [[T; 3]; 3]| {
        let mut out = [[T::ZERO; 3]; 3];
        for row in 0..3 {
            for column in 0..3 {
                for k in 0..3 {
                    out[row][column] += a[row][k] * b[k][column];
                }
            }
        }
        out
    };
    let sds = product(product(s, d), s);
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(row, column)| {
        let identity = if row == column { T::ONE } else { T::ZERO };
        sds[row][column] + trace * (identity - s[row][column])
    })
}
