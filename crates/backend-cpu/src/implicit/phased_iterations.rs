//! NUMERICS §5, `conjugate_gradient`: its iterations in phases, the products of contacts, the rows, the updates and those of `schwarz`, by threads
//! that join once for a whole solve. The arithmetic is that of `conjugate_gradient.rs`, in its order.
#![allow(unsafe_code)]

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use cloth_core::{
    LinearVector, Real,
    stepper::linear::{Next, Progress, block_sum},
};

use super::{
    conjugate_gradient::{FilterTask, Partial, Passes, RowsTask, UpdateTask},
    schwarz_apply::Application,
};
use crate::{
    memory::{BLOCK, VectorField},
    phases::{self, Leader, Phased, Seats},
    shared::{SharedField, SharedSlice},
};

/// Contacts in one chunk.
const CONTACTS: usize = 128;
/// Rows in one chunk, which have to be parts of a block of sums.
const ROWS: usize = 64;
/// Chunks of rows from which on one more thread helps.
const ROWS_OF_HELPER: usize = 4;

/// Products of contacts with c, if there are contacts.
const PRODUCTS: u32 = 0;
/// s = S A c and c . s.
const IMAGE: u32 = 1;
/// p = c + beta p, q = s + beta q, y += alpha p, r -= alpha q, r . r and, without `schwarz`, c = S P^-1 r and r . c.
const UPDATE: u32 = 2;
/// The first phase of `schwarz`; the last one gives c = S P^-1 r and r . c.
const SCHWARZ: u32 = 3;

/// An iteration, and what it reads and writes.
struct Iteration<'a, T> {
    passes: &'a Passes<'a, T>,
    schwarz: Option<Application<'a, T>>,
    fields: [SharedField<'a, T>; LinearVector::ALL.len()],
    partials: SharedSlice<'a, Partial>,
    products: SharedSlice<'a, [T; 3]>,
    /// Chunks of rows of each block that are not done in this iteration.
    rows_left: &'a [AtomicU32],
    /// Bits of alpha and beta.
    factors: [AtomicU64; 2],
}

impl<T: Real> Iteration<'_, T> {
    fn field(&self, vector: LinearVector) -> &SharedField<'_, T> {
        &self.fields[vector as usize]
    }

    fn products(&self, chunk: usize) {
        let first = chunk * CONTACTS;
        let rows = &self.passes.matrix.rows;
        let end = (first + CONTACTS).min(rows.len());
        // SAFETY: this phase writes products alone, those of a chunk by the thread that has taken it.
        let (vector, out) = unsafe {
            (self.field(LinearVector::Preconditioned).view(), self.products.part(first..end))
        };
        rows.products_of(first, vector, out, self.passes.arch);
    }

    fn image(&self, chunk: usize) {
        let (start, arch) = (chunk * ROWS, self.passes.arch);
        let image = self.field(LinearVector::Image);
        // SAFETY: nobody writes c or products in this phase; rows of a chunk are those of the thread that has taken it.
        let (from, products, to) = unsafe {
            let from = self.field(LinearVector::Preconditioned).view();
            (from, self.products.all(), image.chunk(start, ROWS))
        };
        arch.dispatch(RowsTask { passes: self.passes, from, products, start, to });
        let block = start / BLOCK;
        // Who is the last in a block has all of its rows, which the others have released.
        if self.rows_left[block].fetch_sub(1, Ordering::AcqRel) > 1 {
            return;
        }
        self.rows_left[block].store(row_chunks(block, image.len()), Ordering::Relaxed);
        // SAFETY: all chunks of this block are done, and no other thread is told that it is the last one.
        let (to, partial) =
            unsafe { (image.chunk(block * BLOCK, BLOCK), self.partials.part(block..block + 1)) };
        let task = FilterTask { filter: self.passes.filter, from, block, to };
        partial[0] = arch.dispatch(task);
    }

    fn update(&self, block: usize) {
        use LinearVector::{Direction, DirectionImage, Image, Preconditioned, Residual, Solution};
        let factor =
            |which: usize| T::from_f64(f64::from_bits(self.factors[which].load(Ordering::Relaxed)));
        // SAFETY: nobody writes s in this phase; a block is that of the thread that has taken it.
        let (image, [y, r, c, p, q], partial) = unsafe {
            let own = |vector| self.field(vector).chunk(block * BLOCK, BLOCK);
            let fields = [Solution, Residual, Preconditioned, Direction, DirectionImage].map(own);
            (self.field(Image).view(), fields, self.partials.part(block..block + 1))
        };
        let (passes, alpha, beta) = (self.passes, factor(0), factor(1));
        let has_coarse = self.schwarz.is_some();
        let task = UpdateTask { passes, has_coarse, image, block, alpha, beta, y, r, c, p, q };
        partial[0] = passes.arch.dispatch(task);
    }

    fn precondition(&self, phase: u32, chunk: usize) {
        use LinearVector::{Preconditioned, Residual};
        let vectors = (self.field(Residual), self.field(Preconditioned), &self.partials);
        if let Some(schwarz) = &self.schwarz {
            // SAFETY: these are phases, in which nobody else has r or c.
            unsafe { schwarz.work(phase, chunk, vectors) }
        }
    }

    /// Sums of all blocks, between two phases.
    fn sum(&self, which: usize) -> f64 {
        // SAFETY: no phase is under way.
        let partials = unsafe { self.partials.all() };
        block_sum(partials.iter().map(|partial| partial[which]))
    }
}

impl<T: Real> Phased for Iteration<'_, T> {
    fn phases(&self) -> u32 {
        SCHWARZ + self.schwarz.as_ref().map_or(0, Application::phases)
    }

    fn chunks(&self, phase: u32) -> usize {
        let particles = self.field(LinearVector::Image).len();
        match phase {
            PRODUCTS => self.passes.matrix.rows.len().div_ceil(CONTACTS),
            IMAGE => particles.div_ceil(ROWS),
            UPDATE => self.rows_left.len(),
            _ => {
                let of_schwarz =
                    |schwarz: &Application<'_, T>| schwarz.chunks(phase - SCHWARZ, particles);
                self.schwarz.as_ref().map_or(0, of_schwarz)
            }
        }
    }

    fn work(&self, phase: u32, chunk: usize) {
        match phase {
            PRODUCTS => self.products(chunk),
            IMAGE => self.image(chunk),
            UPDATE => self.update(chunk),
            _ => self.precondition(phase - SCHWARZ, chunk),
        }
    }
}

/// Chunks of rows in a block of so many particles.
fn row_chunks(block: usize, count: usize) -> u32 {
    (count - block * BLOCK).min(BLOCK).div_ceil(ROWS) as u32
}

/// An iteration whose phases this thread leads.
struct Led<'a, 'l, 'i, T: Real> {
    iteration: &'a Iteration<'i, T>,
    leader: &'a mut Leader<'l, Iteration<'i, T>>,
}

impl<T: Real> Led<'_, '_, '_, T> {
    /// s = S A c; returns c . s.
    fn image(&mut self) -> f64 {
        if self.iteration.chunks(PRODUCTS) > 0 {
            self.leader.run(PRODUCTS);
        }
        self.leader.run(IMAGE);
        self.iteration.sum(0)
    }

    /// p = c + beta p, q = s + beta q, y += alpha p, r -= alpha q, c = S P^-1 r; returns r . c and r . r.
    fn update(&mut self, [alpha, beta]: [f64; 2]) -> [f64; 2] {
        for (factor, value) in self.iteration.factors.iter().zip([alpha, beta]) {
            factor.store(value.to_bits(), Ordering::Relaxed);
        }
        self.leader.run(UPDATE);
        let square = self.iteration.sum(1);
        (SCHWARZ..self.iteration.phases()).for_each(|phase| self.leader.run(phase));
        [self.iteration.sum(0), square]
    }

    /// Iterations, once residual and preconditioned residual are there, up to a decision that is not to go on.
    fn iterate(&mut self, progress: &mut Progress, mut gamma: f64) -> Next {
        loop {
            match progress.next(gamma) {
                Next::Iterate => {}
                other => return other,
            }
            let delta = self.image();
            let (alpha, beta) = match progress.advance(gamma, delta) {
                Ok(factors) => factors,
                Err(instead) => return instead,
            };
            let [next_gamma, square] = self.update([alpha, beta]);
            gamma = next_gamma;
            progress.end(square.sqrt());
        }
    }
}

/// What solves work with that no solve needs of another.
#[derive(Debug, Default)]
pub(super) struct Scratch<T> {
    /// Of contacts of triangles and a vector.
    pub(super) products: Vec<[T; 3]>,
    rows_left: Vec<AtomicU32>,
    pub(super) seats: Seats,
}

/// The iterations, with `schwarz` if it is the preconditioner.
pub(super) fn iterate<T: Real>(
    passes: &Passes<'_, T>,
    schwarz: Option<Application<'_, T>>,
    fields: &mut [VectorField<T>; LinearVector::ALL.len()],
    (partials, scratch): (&mut [Partial], &mut Scratch<T>),
    progress: &mut Progress,
    gamma: f64,
) -> Next {
    let Scratch { products, rows_left, seats } = scratch;
    products.resize(passes.matrix.rows.len(), [T::ZERO; 3]);
    let fields = fields.each_mut().map(SharedField::new);
    let count = fields[LinearVector::Image as usize].len();
    rows_left.clear();
    rows_left.extend((0..partials.len()).map(|block| AtomicU32::new(row_chunks(block, count))));
    let iteration = Iteration {
        passes,
        schwarz,
        fields,
        partials: SharedSlice::new(partials),
        products: SharedSlice::new(products),
        rows_left,
        factors: [AtomicU64::new(0), AtomicU64::new(0)],
    };
    let iteration = &iteration;
    let helpers = (rayon::current_num_threads() - 1).min(iteration.chunks(IMAGE) / ROWS_OF_HELPER);
    let seats = (seats, helpers);
    phases::lead(iteration, seats, |leader| Led { iteration, leader }.iterate(progress, gamma))
}
