//! NUMERICS §5, `conjugate_gradient`, fused: the two passes over the particles of an iteration. They do the arithmetic of the single stages in
//! their order.

use cloth_core::Real;
use pulp::NullaryFnOnce;

use super::{
    filter::Filter,
    matrix::{BlockField, Matrix},
    matrix_apply, preconditioner,
    vector_operations::block_dot,
};
use crate::{
    memory::{BLOCK, FieldView, LANES, Lanes, lanes, lanes_mut},
    springs::SpringColumns,
};

/// Sums of one block.
pub(super) type Partial = [f64; 2];

/// What all passes read.
pub(super) struct Passes<'a, T> {
    pub(super) matrix: &'a Matrix<T>,
    pub(super) springs: &'a SpringColumns<T>,
    /// Of blocks of single particles.
    pub(super) inverse: &'a BlockField<T>,
    pub(super) filter: Filter<'a, T>,
    pub(super) count: usize,
    pub(super) arch: pulp::Arch,
}

/// to = A from on some rows, compiled for each instruction set.
pub(super) struct RowsTask<'a, 'b, T> {
    pub(super) passes: &'a Passes<'a, T>,
    pub(super) from: FieldView<'a, T>,
    pub(super) products: &'a [[T; 3]],
    pub(super) start: usize,
    pub(super) to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for RowsTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let Passes { matrix, springs, count, .. } = self.passes;
        let vector = (self.from, self.products);
        matrix_apply::rows(matrix, springs, vector, (self.start, *count), &mut self.to);
    }
}

/// to = S to on one block, compiled for each instruction set; gives from . to.
pub(super) struct FilterTask<'a, 'b, T> {
    pub(super) filter: Filter<'a, T>,
    pub(super) from: FieldView<'a, T>,
    pub(super) block: usize,
    pub(super) to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for FilterTask<'_, '_, T> {
    type Output = Partial;

    #[inline(always)]
    fn call(mut self) -> Partial {
        self.filter.apply(self.block, &mut self.to);
        let [x, y, z] = &self.to;
        let from = self.from.range((self.block * BLOCK) as isize, x.len());
        [block_dot(from, [x, y, z]), 0.0]
    }
}

/// The updates of one block, compiled for each instruction set; gives r . c and r . r.
pub(super) struct UpdateTask<'a, 'b, T> {
    pub(super) passes: &'a Passes<'a, T>,
    /// Whether groups of particles add to what the blocks make of a vector, in phases of their own.
    pub(super) has_coarse: bool,
    pub(super) image: FieldView<'a, T>,
    pub(super) block: usize,
    pub(super) alpha: T,
    pub(super) beta: T,
    pub(super) y: [&'b mut [T]; 3],
    pub(super) r: [&'b mut [T]; 3],
    pub(super) c: [&'b mut [T]; 3],
    pub(super) p: [&'b mut [T]; 3],
    pub(super) q: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for UpdateTask<'_, '_, T> {
    type Output = Partial;

    #[inline(always)]
    fn call(mut self) -> Partial {
        let Passes { inverse, filter, .. } = self.passes;
        let start = self.block * BLOCK;
        for local in (0..self.y[0].len()).step_by(LANES) {
            let image = self.image.packet((start + local) as isize);
            let mut residual = [[T::ZERO; LANES]; 3];
            for axis in 0..3 {
                residual[axis] = self.axis(axis, local, image[axis]);
            }
            if self.has_coarse {
                continue;
            }
            let preconditioned =
                preconditioner::packet(inverse, start + local, residual.each_ref());
            for axis in 0..3 {
                *lanes_mut(self.c[axis], local) = preconditioned[axis];
            }
        }
        if self.has_coarse {
            let [x, y, z] = &self.r;
            let r: [&[T]; 3] = [x, y, z];
            return [0.0, block_dot(r, r)];
        }
        filter.apply(self.block, &mut self.c);
        let ([rx, ry, rz], [cx, cy, cz]) = (&self.r, &self.c);
        let r: [&[T]; 3] = [rx, ry, rz];
        [block_dot(r, [cx, cy, cz]), block_dot(r, r)]
    }
}

impl<T: Real> UpdateTask<'_, '_, T> {
    /// One axis of a packet; returns its residual.
    #[inline(always)]
    fn axis(&mut self, axis: usize, local: usize, image: &Lanes<T>) -> Lanes<T> {
        // All is loaded before anything is stored, so that no address has to be compared with another.
        let c = *lanes(self.c[axis], local);
        let mut p = *lanes(self.p[axis], local);
        let mut q = *lanes(self.q[axis], local);
        let mut y = *lanes(self.y[axis], local);
        let mut r = *lanes(self.r[axis], local);
        // The first iteration has beta = 0, and directions of an earlier solve, finite or not.
        if self.beta == T::ZERO {
            (p, q) = ([T::ZERO; LANES], [T::ZERO; LANES]);
        }
        for lane in 0..LANES {
            p[lane] = c[lane] + self.beta * p[lane];
            q[lane] = image[lane] + self.beta * q[lane];
            y[lane] = self.alpha * p[lane] + y[lane];
            r[lane] = -self.alpha * q[lane] + r[lane];
        }
        *lanes_mut(self.p[axis], local) = p;
        *lanes_mut(self.q[axis], local) = q;
        *lanes_mut(self.y[axis], local) = y;
        *lanes_mut(self.r[axis], local) = r;
        r
    }
}
