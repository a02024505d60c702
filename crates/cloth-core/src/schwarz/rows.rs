//! A matrix as the preconditioner reads it.

use crate::Real;

/// A 3 x 3 block, row by row.
pub type Block = [[f64; 3]; 3];

/// What couples two particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
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
pub trait Rows: Sync {
    /// B of a particle: all that does not act between particles.
    fn base(&self, particle: usize) -> Block;

    /// S of a particle, `None` for the identity.
    fn filter(&self, particle: usize) -> Option<Block>;

    /// The place of a particle \[m\].
    fn position(&self, particle: usize) -> [f64; 3];

    /// The blocks off the diagonal, unfiltered, in a fixed order. A column may come more than once.
    fn row(&self, particle: usize, visit: &mut impl FnMut(usize, Block, Coupling));
}

/// -(g I + u u^T).
#[must_use]
pub fn rank_one<T: Real>(u: [T; 3], g: T) -> Block {
    let (u, g) = (u.map(T::to_f64), g.to_f64());
    std::array::from_fn(|row| {
        std::array::from_fn(|column| -(u[row] * u[column] + if row == column { g } else { 0.0 }))
    })
}

/// xx, yy, zz, xy, xz, yz, row by row.
#[must_use]
pub fn symmetric<T: Real>(block: [T; 6]) -> Block {
    let [xx, yy, zz, xy, xz, yz] = block.map(T::to_f64);
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}
