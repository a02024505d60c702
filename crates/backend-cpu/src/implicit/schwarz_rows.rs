//! The matrix S A S of an implicit substep as the preconditioner `schwarz` reads it.

use cloth_core::{
    Real,
    schwarz::{Block, Coupling, Rows, rank_one, symmetric},
};

use super::{matrix::Matrix, particle_filters::ParticleFilters};
use crate::{memory::FieldView, springs::SpringColumns};

/// The matrix of an implicit substep.
#[derive(Clone, Copy)]
pub(super) struct SystemRows<'a, T> {
    pub(super) matrix: &'a Matrix<T>,
    pub(super) springs: &'a SpringColumns<T>,
    pub(super) filters: &'a ParticleFilters<T>,
    pub(super) position: FieldView<'a, T>,
}

impl<T: Real> Rows for SystemRows<'_, T> {
    fn base(&self, particle: usize) -> Block {
        let mut base = symmetric(self.matrix.base.get(particle));
        let of_bodies = symmetric(self.matrix.rows.row_sum(particle));
        for (row, of_bodies) in base.iter_mut().zip(of_bodies) {
            row.iter_mut().zip(of_bodies).for_each(|(entry, of_bodies)| *entry += of_bodies);
        }
        base
    }

    fn filter(&self, particle: usize) -> Option<Block> {
        self.filters.get(particle).map(|filter| symmetric(*filter))
    }

    fn position(&self, particle: usize) -> [f64; 3] {
        self.position.get(particle).map(T::to_f64)
    }

    fn row(&self, particle: usize, visit: &mut impl FnMut(usize, Block, Coupling)) {
        self.matrix.row_factors(self.springs, particle, |column, u, g| {
            visit(column, rank_one(u, g), Coupling::Elastic);
        });
        if let Some(elements) = &self.matrix.elements {
            elements.row(particle, |column, block| {
                visit(column, block.map(|row| row.map(T::to_f64)), Coupling::Elastic);
            });
        }
        for pair in self.matrix.contacts.of(particle) {
            visit(pair.partner, rank_one(pair.u, T::ZERO), Coupling::Contact);
        }
        // The weights of a contact of cloths sum up to zero, as the rows of this matrix do.
        self.matrix.rows.row(particle, |column, block| {
            visit(column, symmetric(block), Coupling::Contact);
        });
    }
}
