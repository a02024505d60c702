//! All memory of the linear system, and its stages.

use cloth_core::{
    ConstraintStatistics, GroupHierarchy, LinearOutcome, LinearVector, MatrixBlock, Model,
    NewtonStart, Preconditioner, Real, Result,
    contact::{BodyMotion, ContactSet},
    schwarz::{CycleVectors, Reuse, Schwarz},
    stepper::linear::{Next, Progress},
};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    assembled::Assembled,
    conjugate_gradient::Passes,
    constraints::{Constraints, Detection, Solve},
    filter::Filter,
    implicit_assemble::Assembly,
    matrix::{BlockField, Matrix},
    matrix_apply,
    particle_filters::ParticleFilters,
    phased_iterations::{self, Scratch},
    preconditioner,
    schwarz_apply::{self, Application, Coarse},
    schwarz_rows::SystemRows,
    spring_linearise, vector_operations,
    vectors::LinearVectors,
};
use crate::{
    aerodynamic_forces::Aerodynamics,
    block_impulses::BlockImpulses,
    collider_response::ColliderAt,
    contact::{Contact, response::Penalty},
    fabric::Fabric,
    memory::{BLOCK, FieldView, LANES, Masses, Motion, VectorField, lanes_mut},
    spring_forces::MotionView,
    springs::SpringColumns,
};

/// The system and all that solves it.
pub(crate) struct ImplicitSystem<T> {
    matrix: Matrix<T>,
    constraints: Constraints<T>,
    vectors: LinearVectors<T>,
    inverse: BlockField<T>,
    partials: Vec<[f64; 2]>,
    scratch: Scratch<T>,
    count: usize,
    /// The preconditioner that was built last.
    preconditioner: Preconditioner,
    /// Once a solver has asked for it.
    assembled: Option<Assembled<T>>,
    /// Once a solver has asked for it.
    schwarz: Option<Box<Coarse>>,
    reuse: Reuse,
    /// Those of the last build of it.
    filters: ParticleFilters<T>,
}

/// What the stages read of the solver they belong to.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a, T> {
    pub(crate) springs: &'a SpringColumns<T>,
    pub(crate) masses: &'a Masses<T>,
    pub(crate) motion: &'a Motion<T>,
    /// Positions and velocities at the start of the substep.
    pub(crate) kept: &'a Motion<T>,
    /// Acceleration of gravity and uniform fields \[m/s^2\], and drag rate \[1/s\].
    pub(crate) fields: ([T; 3], [T; 3]),
    /// Length of the substep \[s\].
    pub(crate) length: T,
    pub(crate) arch: pulp::Arch,
}

impl<T: Real> ImplicitSystem<T> {
    pub(crate) fn new(springs: &SpringColumns<T>, model: &Model) -> Self {
        let count = model.particle_count();
        Self {
            matrix: Matrix::new(springs, model),
            constraints: Constraints::new(count),
            vectors: LinearVectors::new(count, springs.margin()),
            inverse: BlockField::new(count, true),
            partials: vec![[0.0; 2]; count.div_ceil(BLOCK)],
            scratch: Scratch::default(),
            count,
            preconditioner: Preconditioner::default(),
            assembled: None,
            schwarz: None,
            reuse: Reuse::default(),
            filters: ParticleFilters::new(0),
        }
    }

    /// A frame or a substep begins, or the state is another: nothing is left of matrices before.
    pub(crate) fn history_forget(&mut self) {
        self.reuse.forget();
    }

    /// The matrix as blocks, up to date.
    fn assembled(&mut self, model: &Model, springs: &SpringColumns<T>) -> Assembled<T> {
        let mut assembled = self.assembled.take().unwrap_or_else(|| Assembled::new(model));
        assembled.update(&self.matrix, springs);
        assembled
    }

    fn matrix_has_changed(&mut self) {
        if let Some(assembled) = &mut self.assembled {
            assembled.outdate();
        }
    }

    pub(crate) const fn vectors(&self) -> &LinearVectors<T> {
        &self.vectors
    }

    pub(crate) fn vectors_mut(&mut self) -> &mut LinearVectors<T> {
        &mut self.vectors
    }

    pub(crate) fn spring_linearise(&mut self, at: Surroundings<'_, T>) {
        let position = FieldView::new(&at.motion.position);
        let factors = &mut self.matrix.factors;
        spring_linearise::run(factors, at.springs, position, at.length, at.arch);
        self.matrix.contacts.clear();
        self.matrix.rows.clear();
    }

    pub(crate) fn contact_linearise(
        &mut self,
        at: Surroundings<'_, T>,
        contact: &Contact<T>,
        penalty: Penalty<T>,
    ) {
        let motion = MotionView::new(at.motion);
        self.matrix.contacts.fill(contact, penalty, motion, self.count, at.length);
    }

    pub(crate) fn triangles_linearise(
        &mut self,
        (set, bodies, start): (&ContactSet<T>, &BodyMotion<T>, NewtonStart),
        length: T,
    ) {
        self.matrix.rows.fill((set, bodies, start), length);
    }

    pub(crate) fn assemble(
        &mut self,
        at: Surroundings<'_, T>,
        (force, aerodynamics, fabric): (
            &VectorField<T>,
            Option<&Aerodynamics<T>>,
            Option<&Fabric<T>>,
        ),
        start: NewtonStart,
    ) {
        let assembly = Assembly {
            springs: at.springs,
            masses: at.masses,
            drag_rate: at.fields.1,
            aerodynamics,
            position: FieldView::new(&at.motion.position),
            velocity: FieldView::new(&at.motion.velocity),
            velocity_start: FieldView::new(&at.kept.velocity),
            force: FieldView::new(force),
            length: at.length,
            start,
            count: self.count,
        };
        if let Some((elements, fabric)) = self.matrix.elements.as_mut().zip(fabric) {
            elements.assemble(fabric, at.arch);
        }
        let right_side = self.vectors.get_mut(LinearVector::RightSide);
        assembly.run(&mut self.matrix, right_side, &mut self.scratch.products, at.arch);
        self.constraints.drag(assembly.velocity, &mut self.matrix, right_side);
        self.matrix_has_changed();
    }

    /// Adds to the diagonals of blocks, and to the right-hand side.
    pub(crate) fn add(&mut self, terms: impl Iterator<Item = (usize, T, [T; 3])>) {
        let right_side = self.vectors.get_mut(LinearVector::RightSide);
        for (particle, term, impulse) in terms {
            let block = [term, term, term, T::ZERO, T::ZERO, T::ZERO];
            self.matrix.base.add(particle, block);
            self.matrix.diagonal.add(particle, block);
            let before = right_side.get(particle);
            right_side.set(particle, std::array::from_fn(|k| before[k] + impulse[k]));
        }
        self.matrix_has_changed();
    }

    pub(crate) fn collider_constraints(
        &mut self,
        at: Surroundings<'_, T>,
        colliders: &[ColliderAt<T>],
        offsets: &[T],
    ) {
        let detection = Detection {
            colliders,
            masses: at.masses,
            offsets,
            position: FieldView::new(&at.motion.position),
            velocity: FieldView::new(&at.motion.velocity),
            acceleration: at.fields.0,
            drag_rate: at.fields.1,
            length: at.length,
            count: self.count,
        };
        self.constraints.detect(&detection, at.arch);
    }

    /// Needs A y as the image.
    pub(crate) fn constraint_release(
        &mut self,
        masses: &Masses<T>,
        velocity: &VectorField<T>,
    ) -> u64 {
        let mut right_side = self.vectors.take(LinearVector::RightSide);
        let solve = Solve {
            image: FieldView::new(self.vectors.get(LinearVector::Image)),
            solution: FieldView::new(self.vectors.get(LinearVector::Solution)),
            velocity: FieldView::new(velocity),
        };
        let changed = self.constraints.release(&solve, masses, &mut self.matrix, &mut right_side);
        self.vectors.put(LinearVector::RightSide, right_side);
        if changed > 0 {
            self.matrix_has_changed();
        }
        changed
    }

    /// With `StepStart` it needs A y as the image.
    pub(crate) fn constraint_impulses(
        &self,
        motion: &Motion<T>,
        start: NewtonStart,
        sums: &mut BlockImpulses,
    ) {
        let view = |vector| FieldView::new(self.vectors.get(vector));
        let image = (start == NewtonStart::StepStart).then(|| view(LinearVector::Image));
        let motion = (FieldView::new(&motion.position), FieldView::new(&motion.velocity));
        self.constraints.impulses((image, view(LinearVector::RightSide)), motion, sums);
    }

    pub(crate) fn constraints_are_empty(&self) -> bool {
        self.constraints.is_empty()
    }

    pub(crate) fn constraint_statistics(&mut self) -> ConstraintStatistics {
        self.constraints.statistics()
    }

    pub(crate) fn constraint_filter(&mut self, vector: LinearVector, masses: &Masses<T>) {
        let filter = Filter { masses, constraints: &self.constraints };
        self.vectors.get_mut(vector).chunks_mut(BLOCK).enumerate().for_each(
            |(block, mut chunk)| {
                filter.apply(block, &mut chunk);
            },
        );
    }

    pub(crate) fn constraint_project(
        &mut self,
        vector: LinearVector,
        masses: &Masses<T>,
        velocity: &VectorField<T>,
    ) {
        let filter = Filter { masses, constraints: &self.constraints };
        let velocity = FieldView::new(velocity);
        self.vectors.get_mut(vector).chunks_mut(BLOCK).enumerate().for_each(
            |(block, mut chunk)| {
                filter.project(block, velocity, &mut chunk);
            },
        );
    }

    /// to = A from, matrix-free.
    pub(crate) fn matrix_apply(
        &mut self,
        springs: &SpringColumns<T>,
        from: LinearVector,
        to: LinearVector,
        arch: pulp::Arch,
    ) {
        let mut image = self.vectors.take(to);
        let vector = FieldView::new(self.vectors.get(from));
        let (matrix, count) = (&self.matrix, self.count);
        matrix.rows.products(vector, &mut self.scratch.products, arch);
        let vector = (vector, &*self.scratch.products);
        image.chunks_mut(BLOCK).enumerate().for_each(|(block, to)| {
            arch.dispatch(ApplyTask { matrix, springs, vector, start: block * BLOCK, count, to });
        });
        self.vectors.put(to, image);
    }

    /// to = A from, from blocks.
    pub(crate) fn matrix_apply_assembled(
        &mut self,
        (model, springs): (&Model, &SpringColumns<T>),
        from: LinearVector,
        to: LinearVector,
    ) {
        let assembled = self.assembled(model, springs);
        let mut image = self.vectors.take(to);
        assembled.apply(self.vectors.get(from), &mut image);
        self.vectors.put(to, image);
        self.assembled = Some(assembled);
    }

    pub(crate) fn direct_solve(
        &mut self,
        (model, springs): (&Model, &SpringColumns<T>),
        masses: &Masses<T>,
    ) -> Result<LinearOutcome> {
        let mut assembled = self.assembled(model, springs);
        let mut solution = self.vectors.take(LinearVector::Solution);
        let filter = Filter { masses, constraints: &self.constraints };
        let right_side = self.vectors.get(LinearVector::RightSide);
        let others = self.matrix.full_blocks(self.count);
        let outcome = assembled.direct_solve((model, &others), &filter, right_side, &mut solution);
        self.vectors.put(LinearVector::Solution, solution);
        self.assembled = Some(assembled);
        outcome
    }

    pub(crate) fn preconditioner_build(
        &mut self,
        (model, springs): (&Model, &SpringColumns<T>),
        (masses, position): (&Masses<T>, &VectorField<T>),
        kind: Preconditioner,
        arch: pulp::Arch,
    ) {
        self.preconditioner = kind;
        if kind == Preconditioner::Schwarz {
            self.schwarz_build((model, springs), (masses, position), arch);
        }
        if kind == Preconditioner::IncompleteCholesky {
            let mut assembled = self.assembled(model, springs);
            let filter = Filter { masses, constraints: &self.constraints };
            assembled.incomplete_build(&filter, arch);
            self.assembled = Some(assembled);
            return;
        }
        let blocks = kind != Preconditioner::Diagonal;
        preconditioner::build(
            &self.matrix.diagonal,
            &self.constraints,
            blocks,
            &mut self.inverse,
            self.count,
            arch,
        );
    }

    fn schwarz_build(
        &mut self,
        (model, springs): (&Model, &SpringColumns<T>),
        (masses, position): (&Masses<T>, &VectorField<T>),
        arch: pulp::Arch,
    ) {
        let Coarse { schwarz, vectors } = &mut **self.schwarz.get_or_insert_with(|| {
            let schwarz = Schwarz::new(GroupHierarchy::new(model));
            Box::new(Coarse { schwarz, vectors: CycleVectors::default() })
        });
        if self.filters.is_empty() {
            self.filters = ParticleFilters::new(self.count);
        }
        let filters = &mut self.filters;
        filters.fill(&Filter { masses, constraints: &self.constraints });
        let (matrix, position) = (&self.matrix, FieldView::new(position));
        let rows = SystemRows { matrix, springs, filters, position };
        if self.reuse.wants_build() {
            schwarz.build(&rows, arch);
        } else {
            schwarz.update(&rows, arch);
        }
        // How large levels are follows from the groups.
        if vectors.levels.is_empty() {
            *vectors = schwarz.vectors();
        }
    }

    /// Notes the iterations of a solve with the preconditioner that is there.
    pub(crate) fn solved(&mut self, outcome: &LinearOutcome) {
        if self.preconditioner == Preconditioner::Schwarz {
            self.reuse.solved(outcome.iterations);
        } else if outcome.restarted {
            self.reuse.forget();
        }
    }

    pub(crate) fn preconditioner_apply(
        &mut self,
        from: LinearVector,
        to: LinearVector,
        masses: &Masses<T>,
        arch: pulp::Arch,
    ) {
        let mut out = self.vectors.take(to);
        let filter = Filter { masses, constraints: &self.constraints };
        if self.preconditioner == Preconditioner::IncompleteCholesky
            && let Some(assembled) = &mut self.assembled
        {
            assembled.incomplete_apply(self.vectors.get(from), &mut out, arch);
            let blocks = out.chunks_mut(BLOCK).enumerate();
            blocks.for_each(|(block, mut chunk)| filter.apply(block, &mut chunk));
            self.vectors.put(to, out);
            return;
        }
        if self.preconditioner == Preconditioner::Schwarz
            && let Some(schwarz) = &mut self.schwarz
        {
            let application = Application::new(schwarz, (&self.inverse, filter), arch);
            let mut vector = self.vectors.take(from);
            let scratch = (&mut *self.partials, &mut self.scratch.seats);
            schwarz_apply::run(application, (&mut vector, &mut out), scratch);
            self.vectors.put(from, vector);
            self.vectors.put(to, out);
            return;
        }
        let vector = FieldView::new(self.vectors.get(from));
        let inverse = &self.inverse;
        out.chunks_mut(BLOCK).enumerate().for_each(|(block, to)| {
            arch.dispatch(PreconditionTask { inverse, filter, vector, block, to });
        });
        self.vectors.put(to, out);
    }

    pub(crate) fn vector_dot(&mut self, a: LinearVector, b: LinearVector, arch: pulp::Arch) -> f64 {
        vector_operations::dot(self.vectors.get(a), self.vectors.get(b), &mut self.partials, arch)
    }

    pub(crate) fn vector_combine(
        &mut self,
        (from_scale, from): (f64, LinearVector),
        (to_scale, to): (f64, LinearVector),
        arch: pulp::Arch,
    ) {
        let mut out = self.vectors.take(to);
        let source = (from != to).then(|| self.vectors.get(from));
        let to_scale = if from == to { from_scale + to_scale } else { to_scale };
        vector_operations::combine((from_scale, source), to_scale, &mut out, arch);
        self.vectors.put(to, out);
    }

    pub(crate) fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) {
        let value = value.map(T::from_f64);
        let to = self.vectors.get_mut(to);
        (0..self.count).for_each(|particle| to.set(particle, value));
    }

    /// The iterations of the conjugate gradient method, fused, from residual and preconditioned
    /// residual.
    pub(crate) fn conjugate_gradient(
        &mut self,
        at: (&SpringColumns<T>, &Masses<T>, pulp::Arch),
        progress: &mut Progress,
        gamma: f64,
    ) -> Next {
        let (springs, masses, arch) = at;
        let is_schwarz = self.preconditioner == Preconditioner::Schwarz;
        let filter = Filter { masses, constraints: &self.constraints };
        let passes = Passes {
            matrix: &self.matrix,
            springs,
            inverse: &self.inverse,
            filter,
            count: self.count,
            arch,
        };
        let schwarz = self.schwarz.as_deref_mut().filter(|_| is_schwarz);
        let schwarz = schwarz.map(|coarse| Application::new(coarse, (&self.inverse, filter), arch));
        let fields = self.vectors.all_mut();
        let scratch = (&mut *self.partials, &mut self.scratch);
        phased_iterations::iterate(&passes, schwarz, fields, scratch, progress, gamma)
    }

    pub(crate) fn matrix_read(&self, springs: &SpringColumns<T>, out: &mut Vec<MatrixBlock>) {
        self.matrix.read(springs, self.count, out);
    }
}

/// A times a vector on one block, compiled for each instruction set.
struct ApplyTask<'a, 'b, T> {
    matrix: &'a Matrix<T>,
    springs: &'a SpringColumns<T>,
    /// And the products of contacts with it.
    vector: (FieldView<'a, T>, &'a [[T; 3]]),
    start: usize,
    count: usize,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for ApplyTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let at = (self.start, self.count);
        matrix_apply::rows(self.matrix, self.springs, self.vector, at, &mut self.to);
    }
}

/// S P^-1 times a vector on one block, compiled for each instruction set.
struct PreconditionTask<'a, 'b, T> {
    inverse: &'a BlockField<T>,
    filter: Filter<'a, T>,
    vector: FieldView<'a, T>,
    block: usize,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for PreconditionTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for local in (0..self.to[0].len()).step_by(LANES) {
            let first = self.block * BLOCK + local;
            let vector = self.vector.packet(first as isize);
            let preconditioned = preconditioner::packet(self.inverse, first, vector);
            for axis in 0..3 {
                *lanes_mut(self.to[axis], local) = preconditioned[axis];
            }
        }
        self.filter.apply(self.block, &mut self.to);
    }
}
