//! The matrix S A S as the preconditioner reads it.

use cloth_core::Real;

use crate::{
    implicit::{matrix::Matrix, particle_filters::ParticleFilters},
    memory::{FieldView, Masses},
    springs::SpringColumns,
};

/// A 3 x 3 block, row by row.
pub(in crate::implicit) type Block = [[f64; 3]; 3];

/// What couples two particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::implicit) enum Coupling {
    /// Springs and triangles.
    Elastic,
    /// Contact between cloths.
    Contact,
}

/// A symmetric matrix of 3 x 3 blocks, A = B - sum over pairs, with rows of zero sum but for B.
///
/// Forces between particles do not change when all of them move together, so that what a block off the diagonal takes, the
/// diagonal has: D_i = B_i - sum over j of A_ij. Summed up like this in double precision the matrix has its small eigenvalues, those
/// of rigid motions, whatever the precision of the solver and however stiff the cloth.
pub(in crate::implicit) trait Rows: Sync {
    /// B of a particle: all that does not act between particles.
    fn base(&self, particle: usize) -> Block;

    /// S of a particle, `None` for the identity.
    fn filter(&self, particle: usize) -> Option<Block>;

    /// The place of a particle \[m\].
    fn position(&self, particle: usize) -> [f64; 3];

    /// The blocks off the diagonal, unfiltered, in a fixed order. A column may come more than once.
    fn row(&self, particle: usize, visit: &mut impl FnMut(usize, Block, Coupling));
}

/// The matrix of an implicit substep.
#[derive(Clone, Copy)]
pub(in crate::implicit) struct SystemRows<'a, T> {
    pub(in crate::implicit) matrix: &'a Matrix<T>,
    pub(in crate::implicit) springs: &'a SpringColumns<T>,
    pub(in crate::implicit) filters: &'a ParticleFilters<T>,
    pub(in crate::implicit) masses: &'a Masses<T>,
    pub(in crate::implicit) position: FieldView<'a, T>,
}

impl<T: Real> Rows for SystemRows<'_, T> {
    fn base(&self, particle: usize) -> Block {
        let mut base = symmetric(self.matrix.base.get(particle));
        let of_bodies = symmetric(self.matrix.rows.row_sum(particle));
        for (row, of_bodies) in base.iter_mut().zip(of_bodies) {
            row.iter_mut().zip(of_bodies).for_each(|(entry, of_bodies)| *entry += of_bodies);
        }
        if let Some(elements) = &self.matrix.elements {
            // Products with the matrix take the diagonal blocks of triangles from there. Rounding may leave less than the mass.
            let own = symmetric(elements.diagonal[particle]);
            let mass = self.masses.mass[particle].to_f64();
            for (row, own) in own.iter().enumerate() {
                (0..3).for_each(|column| base[row][column] -= own[column]);
                base[row][row] = base[row][row].max(mass);
            }
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

/// -(g I + u u^T).
fn rank_one<T: Real>(u: [T; 3], g: T) -> Block {
    let (u, g) = (u.map(T::to_f64), g.to_f64());
    std::array::from_fn(|row| {
        std::array::from_fn(|column| -(u[row] * u[column] + if row == column { g } else { 0.0 }))
    })
}

fn symmetric<T: Real>(block: [T; 6]) -> Block {
    let [xx, yy, zz, xy, xz, yz] = block.map(T::to_f64);
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// a b.
#[inline(always)]
pub(super) fn product(a: &Block, b: &Block) -> Block {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            a[row][0] * b[0][column] + a[row][1] * b[1][column] + a[row][2] * b[2][column]
        })
    })
}
