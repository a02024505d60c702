//! NUMERICS §5, `preconditioner_apply` of `schwarz`: the steps of its cycle, and then what they and the blocks of particles make of a vector, as
//! phases.
#![allow(unsafe_code)]

use cloth_core::{
    GroupHierarchy, Real,
    schwarz::{CycleVectors, Schwarz, Source, Step},
};
use pulp::NullaryFnOnce;

use super::{
    conjugate_gradient::Partial, filter::Filter, matrix::BlockField, preconditioner,
    vector_operations::block_dot,
};
use crate::{
    memory::{BLOCK, FieldView, LANES, VectorField, lanes_mut},
    phases::{self, Phased, Seats},
    shared::{SharedField, SharedSlice},
};

/// The preconditioner and the vectors of its cycles.
pub(super) struct Coarse {
    pub(super) schwarz: Schwarz,
    pub(super) vectors: CycleVectors,
}

/// The vectors of a level that threads share.
struct SharedLevel<'a> {
    right_side: SharedSlice<'a, f64>,
    smoothed: SharedSlice<'a, f64>,
    solution: SharedSlice<'a, f64>,
}

/// What all phases of an application read, and what those of the cycle write.
pub(super) struct Application<'a, T> {
    schwarz: &'a Schwarz,
    moved: SharedSlice<'a, f64>,
    /// Those that there are come first.
    levels: [Option<SharedLevel<'a>>; GroupHierarchy::LEVELS_MAX],
    inverse: &'a BlockField<T>,
    filter: Filter<'a, T>,
    arch: pulp::Arch,
}

/// Vectors by particle: from, to and sums of blocks, from . to.
pub(super) type Vectors<'a, 'b, T> =
    (&'a SharedField<'b, T>, &'a SharedField<'b, T>, &'a SharedSlice<'b, Partial>);

impl<'a, T: Real> Application<'a, T> {
    pub(super) fn new(
        coarse: &'a mut Coarse,
        (inverse, filter): (&'a BlockField<T>, Filter<'a, T>),
        arch: pulp::Arch,
    ) -> Self {
        let Coarse { schwarz, vectors: CycleVectors { moved, levels } } = coarse;
        let mut levels = levels.iter_mut().map(|vectors| SharedLevel {
            right_side: SharedSlice::new(&mut vectors.right_side),
            smoothed: SharedSlice::new(&mut vectors.smoothed),
            solution: SharedSlice::new(&mut vectors.solution),
        });
        Self {
            schwarz,
            moved: SharedSlice::new(moved),
            levels: std::array::from_fn(|_| levels.next()),
            inverse,
            filter,
            arch,
        }
    }

    /// The steps of a cycle, and one more phase for blocks of particles.
    pub(super) fn phases(&self) -> u32 {
        self.schwarz.step_count() as u32 + 1
    }

    /// Chunks of a phase, for so many particles.
    pub(super) fn chunks(&self, phase: u32, particles: usize) -> usize {
        match self.schwarz.step(phase as usize) {
            Some(step) => self.schwarz.chunks(step),
            None => particles.div_ceil(BLOCK),
        }
    }

    /// Does a chunk of a phase.
    ///
    /// # Safety
    /// Phases follow each other, each thread does chunks of the same phase, each chunk is done by one of them, and nobody else has these vectors.
    pub(super) unsafe fn work(&self, phase: u32, chunk: usize, vectors: Vectors<'_, '_, T>) {
        // SAFETY: as the caller says.
        unsafe {
            match self.schwarz.step(phase as usize) {
                Some(step) => self.step(step, chunk, vectors.0),
                None => self.finish(chunk, vectors),
            }
        }
    }

    /// # Safety
    /// As [`Self::work`].
    unsafe fn step(&self, step: Step, chunk: usize, from: &SharedField<'_, T>) {
        let (schwarz, arch) = (self.schwarz, self.arch);
        let [own, entries_below] = schwarz.entries(step, chunk);
        let level = schwarz.level_of(step);
        let Some(shared) = &self.levels[level] else { return };
        let below = level.checked_sub(1).and_then(|level| self.levels[level].as_ref());
        // SAFETY: a step down writes right-hand side and smoothed entries of its chunk, and reads those of the level below, which nobody writes in it.
        // Another step reads both of its level, and writes solutions of its chunk and what it moves: nodes or particles that are grouped in its
        // nodes; each is in one group.
        unsafe {
            if let Step::Down(level) = step {
                let view = from.view();
                let from = match below {
                    None => Source::Particles(|particle| view.get(particle)),
                    Some(below) => Source::Level(below.right_side.all(), below.smoothed.all()),
                };
                let smoothed = if shared.smoothed.is_empty() { 0..0 } else { own.clone() };
                let to = (shared.right_side.part(own), shared.smoothed.part(smoothed));
                schwarz.down((level, chunk), from, to, arch);
            } else {
                let moved = below.map_or(&self.moved, |below| &below.smoothed);
                let to = (shared.solution.part(own), moved.part(entries_below));
                let from = (shared.right_side.all(), shared.smoothed.all());
                schwarz.up((step, chunk), from, to, arch);
            }
        }
    }

    /// # Safety
    /// As [`Self::work`].
    unsafe fn finish(&self, block: usize, (from, to, partials): Vectors<'_, '_, T>) {
        // SAFETY: nobody writes what particles are moved by or `from` in this phase; a block is that of the thread that has taken it.
        let (moved, from, to, partial) = unsafe {
            (
                self.moved.all(),
                from.view(),
                to.chunk(block * BLOCK, BLOCK),
                partials.part(block..block + 1),
            )
        };
        partial[0] = self.arch.dispatch(Finish { application: self, moved, from, block, to });
    }
}

/// to = S P^-1 from on one block, once the cycle is done, compiled for each instruction set; gives from . to.
struct Finish<'a, 'b, T> {
    application: &'a Application<'a, T>,
    moved: &'a [f64],
    from: FieldView<'a, T>,
    block: usize,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for Finish<'_, '_, T> {
    type Output = Partial;

    #[inline(always)]
    fn call(mut self) -> Partial {
        let Application { schwarz, inverse, filter, .. } = self.application;
        let (start, length) = (self.block * BLOCK, self.to[0].len());
        for local in (0..length).step_by(LANES) {
            let first = start + local;
            let from = self.from.packet(first as isize);
            let mut found = preconditioner::packet(inverse, first, from);
            for lane in 0..LANES.min(schwarz.len() - first) {
                let moved = schwarz.moved(first + lane, self.moved);
                (0..3).for_each(|axis| found[axis][lane] += moved[axis]);
            }
            for axis in 0..3 {
                *lanes_mut(self.to[axis], local) = found[axis];
            }
        }
        filter.apply(self.block, &mut self.to);
        let [x, y, z] = &self.to;
        let from = self.from.range(start as isize, length);
        [block_dot(from, [x, y, z]), 0.0]
    }
}

/// An application alone.
struct Alone<'a, T> {
    application: Application<'a, T>,
    from: SharedField<'a, T>,
    to: SharedField<'a, T>,
    partials: SharedSlice<'a, Partial>,
}

impl<T: Real> Phased for Alone<'_, T> {
    fn phases(&self) -> u32 {
        self.application.phases()
    }

    fn chunks(&self, phase: u32) -> usize {
        self.application.chunks(phase, self.to.len())
    }

    fn work(&self, phase: u32, chunk: usize) {
        // SAFETY: these are phases, and the vectors are borrowed for all of them.
        unsafe { self.application.work(phase, chunk, (&self.from, &self.to, &self.partials)) }
    }
}

/// to = S P^-1 from.
pub(super) fn run<T: Real>(
    application: Application<'_, T>,
    (from, to): (&mut VectorField<T>, &mut VectorField<T>),
    (partials, seats): (&mut [Partial], &mut Seats),
) {
    let alone = Alone {
        application,
        from: SharedField::new(from),
        to: SharedField::new(to),
        partials: SharedSlice::new(partials),
    };
    let phases = alone.phases();
    let helpers = (rayon::current_num_threads() - 1).min(alone.chunks(phases - 1));
    let seats = (seats, helpers);
    phases::lead(&alone, seats, |leader| (0..phases).for_each(|phase| leader.run(phase)));
}
