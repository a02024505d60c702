//! The matrix as blocks, and what works on that: made only when a solver asks for it.

use cloth_core::{LinearOutcome, Model, Neighbours, Real, Result};

use super::{
    block_matrix::BlockMatrix,
    direct::{DirectSolver, FullBlock},
    filter::Filter,
    incomplete_cholesky::IncompleteCholesky,
    matrix::Matrix,
    particle_filters::ParticleFilters,
};
use crate::{memory::VectorField, springs::SpringColumns};

/// The assembled matrix, its incomplete factorisation and its direct solver.
pub(super) struct Assembled<T> {
    blocks: BlockMatrix<T>,
    filters: ParticleFilters<T>,
    incomplete: IncompleteCholesky<T>,
    direct: Option<DirectSolver>,
    /// Whether `blocks` has the numbers of the present matrix.
    is_current: bool,
}

impl<T: Real> Assembled<T> {
    pub(super) fn new(model: &Model) -> Self {
        let count = model.particle_count();
        Self {
            blocks: BlockMatrix::of_springs(model.springs(), count),
            filters: ParticleFilters::new(count),
            incomplete: IncompleteCholesky::default(),
            direct: None,
            is_current: false,
        }
    }

    /// The matrix has changed.
    pub(super) fn outdate(&mut self) {
        self.is_current = false;
    }

    /// Takes the numbers of the matrix if they are new.
    pub(super) fn update(&mut self, matrix: &Matrix<T>, springs: &SpringColumns<T>) {
        if !self.is_current {
            self.blocks.fill(matrix, springs);
            self.is_current = true;
        }
    }

    /// to = A from.
    pub(super) fn apply(&self, from: &VectorField<T>, to: &mut VectorField<T>) {
        self.blocks.apply(from, to);
    }

    pub(super) fn incomplete_build(&mut self, filter: &Filter<'_, T>, arch: pulp::Arch) {
        self.filters.fill(filter);
        self.incomplete.build(&self.blocks, &self.filters, arch);
    }

    /// to = P^-1 from, P the incomplete factorisation.
    pub(super) fn incomplete_apply(
        &mut self,
        from: &VectorField<T>,
        to: &mut VectorField<T>,
        arch: pulp::Arch,
    ) {
        self.incomplete.apply(from, to, arch);
    }

    /// With the blocks off the diagonal that triangles add, in fabric and in contact.
    pub(super) fn direct_solve(
        &mut self,
        (model, others): (&Model, &[FullBlock<T>]),
        filter: &Filter<'_, T>,
        right_side: &VectorField<T>,
        solution: &mut VectorField<T>,
    ) -> Result<LinearOutcome> {
        self.filters.fill(filter);
        let direct = self.direct.get_or_insert_with(|| {
            let pairs = Neighbours::new(&model.interactions().in_matrix()).pairs().collect();
            DirectSolver::new(model.positions(), pairs)
        });
        direct.solve((&self.blocks, others), &self.filters, right_side, solution)
    }
}
