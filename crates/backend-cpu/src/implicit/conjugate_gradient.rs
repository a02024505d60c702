//! NUMERICS §5, `conjugate_gradient`, fused: two passes over the particles for each iteration. They do the arithmetic of the single stages in
//! their order.

use cloth_core::{
    LinearVector, Real,
    schwarz::Schwarz,
    stepper::linear::{Next, Progress, block_sum},
};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    filter::Filter,
    matrix::{BlockField, Matrix},
    matrix_apply, preconditioner,
    system::schwarz_apply,
    vector_operations::block_dot,
};
use crate::{
    memory::{BLOCK, FieldView, LANES, Lanes, VectorField, lanes, lanes_mut},
    springs::SpringColumns,
};

/// Rows in one task: a block of them would be too long for that.
const ROWS: usize = 64;

/// Blocks in one task of a pass that does little.
const SHORT: usize = 4;

/// Sums of one block.
pub(super) type Partial = [f64; 2];

/// Sums of blocks, and products of contacts.
pub(super) type Scratch<'a, T> = (&'a mut [Partial], &'a mut Vec<[T; 3]>);

/// What all passes read.
pub(super) struct Passes<'a, T> {
    pub(super) matrix: &'a Matrix<T>,
    pub(super) springs: &'a SpringColumns<T>,
    /// Of blocks of single particles, if these are the preconditioner.
    pub(super) inverse: Option<&'a BlockField<T>>,
    pub(super) filter: Filter<'a, T>,
    pub(super) count: usize,
    pub(super) arch: pulp::Arch,
}

impl<T: Real> Passes<'_, T> {
    /// to = S A from; returns from . to.
    fn apply(
        &self,
        from: &VectorField<T>,
        to: &mut VectorField<T>,
        (partials, products): Scratch<'_, T>,
    ) -> f64 {
        let from = FieldView::new(from);
        self.matrix.rows.products(from, products, self.arch);
        let products = &**products;
        to.chunks_mut(ROWS).enumerate().for_each(|(chunk, to)| {
            let start = chunk * ROWS;
            self.arch.dispatch(RowsTask { passes: self, from, products, start, to });
        });
        self.filter_dot(from, to, partials)
    }

    /// to = S to; returns from . to.
    fn filter_dot(
        &self,
        from: FieldView<'_, T>,
        to: &mut VectorField<T>,
        partials: &mut [Partial],
    ) -> f64 {
        let blocks = to.chunks_mut(BLOCK).zip(partials.par_iter_mut()).enumerate();
        blocks.with_min_len(SHORT).for_each(|(block, (to, partial))| {
            let task = FilterTask { filter: self.filter, from, block, to };
            *partial = self.arch.dispatch(task);
        });
        block_sum(partials.iter().map(|partial| partial[0]))
    }

    /// p = c + beta p, q = s + beta q, y += alpha p, r -= alpha q; returns r . r.
    fn update(
        &self,
        fields: &mut [VectorField<T>; LinearVector::ALL.len()],
        (alpha, beta): (f64, f64),
        partials: &mut [Partial],
    ) -> f64 {
        let [solution, _, residual, preconditioned, image, direction, direction_image] = fields;
        let image = FieldView::new(image);
        let blocks = (
            solution.chunks_mut(BLOCK),
            residual.chunks_mut(BLOCK),
            preconditioned.chunks_mut(BLOCK),
            direction.chunks_mut(BLOCK),
            direction_image.chunks_mut(BLOCK),
        );
        let blocks = blocks.into_par_iter().zip(partials.par_iter_mut()).enumerate();
        blocks.with_min_len(SHORT).for_each(|(block, ((y, r, c, p, q), partial))| {
            let (alpha, beta) = (T::from_f64(alpha), T::from_f64(beta));
            let task = UpdateTask { passes: self, image, block, alpha, beta, y, r, c, p, q };
            *partial = self.arch.dispatch(task);
        });
        block_sum(partials.iter().map(|partial| partial[1]))
    }
}

/// The halves of an iteration, by whatever threads.
pub(super) trait Halves {
    /// s = S A c; returns c . s.
    fn image(&mut self) -> f64;

    /// p = c + beta p, q = s + beta q, y += alpha p, r -= alpha q, c = S P^-1 r, with alpha and beta; returns r . c and r . r.
    fn update(&mut self, factors: (f64, f64)) -> [f64; 2];
}

/// The conjugate gradient iterations, once residual and preconditioned residual are there, up to a decision that is not to go on.
pub(super) fn iterate(halves: &mut impl Halves, progress: &mut Progress, mut gamma: f64) -> Next {
    loop {
        match progress.next(gamma) {
            Next::Iterate => {}
            other => return other,
        }
        let delta = halves.image();
        let factors = match progress.advance(gamma, delta) {
            Ok(factors) => factors,
            Err(instead) => return instead,
        };
        let [next_gamma, square] = halves.update(factors);
        gamma = next_gamma;
        progress.end(square.sqrt());
    }
}

/// With `schwarz`, each pass by the pool of threads.
pub(super) struct WithSchwarz<'a, 'p, T> {
    pub(super) passes: &'a Passes<'p, T>,
    pub(super) schwarz: &'a mut Schwarz<T>,
    pub(super) fields: &'a mut [VectorField<T>; LinearVector::ALL.len()],
    pub(super) scratch: Scratch<'a, T>,
}

impl<T: Real> Halves for WithSchwarz<'_, '_, T> {
    fn image(&mut self) -> f64 {
        let [_, _, _, preconditioned, image, _, _] = &mut *self.fields;
        let (partials, products) = &mut self.scratch;
        self.passes.apply(preconditioned, image, (partials, products))
    }

    fn update(&mut self, factors: (f64, f64)) -> [f64; 2] {
        let partials = &mut *self.scratch.0;
        let square = self.passes.update(self.fields, factors, partials);
        let [_, _, residual, preconditioned, ..] = &mut *self.fields;
        let residual = FieldView::new(residual);
        schwarz_apply(self.schwarz, residual, preconditioned, self.passes.arch);
        [self.passes.filter_dot(residual, preconditioned, partials), square]
    }
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
            let Some(inverse) = inverse else { continue };
            let preconditioned =
                preconditioner::packet(inverse, start + local, residual.each_ref());
            for axis in 0..3 {
                *lanes_mut(self.c[axis], local) = preconditioned[axis];
            }
        }
        if inverse.is_none() {
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
