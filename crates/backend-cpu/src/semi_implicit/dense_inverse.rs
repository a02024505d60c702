//! The inverse of the constant matrix as a dense matrix, as Desbrun, Schröder and Barr (1999) had it.

use cloth_core::{Error, Real, Result};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::{
    memory::{BLOCK, VectorField},
    sparse_cholesky::{SparseCholesky, TILE, tile_product},
};

/// Particles for which the inverse still has a reasonable size: 16.8 million numbers.
const PARTICLES_MAX: usize = 4096;

/// The inverse in tiles of rows, each column by column.
#[derive(Debug, Default)]
pub(super) struct DenseInverse<T> {
    tiles: Vec<T>,
    count: usize,
}

/// # Errors
/// `LimitExceeded` if there are too many particles for a dense matrix.
pub(super) fn check_size(count: usize) -> Result<()> {
    if count <= PARTICLES_MAX {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        limit: "particles of a dense inverse",
        requested: count as u64,
        max: PARTICLES_MAX as u64,
    })
}

impl<T: Real> DenseInverse<T> {
    /// Inverts what was factorised last, column by column.
    pub(super) fn fill(&mut self, factorisation: &mut SparseCholesky) {
        let count = factorisation.pattern().len();
        self.count = count;
        self.tiles.clear();
        self.tiles.resize(count.next_multiple_of(TILE) * count, T::ZERO);
        let mut unit = vec![0.0; count];
        for column in 0..count {
            unit.fill(0.0);
            unit[column] = 1.0;
            factorisation.solve_in_place(&mut unit);
            for (row, &value) in unit.iter().enumerate() {
                let tile = row / TILE * count;
                self.tiles[(tile + column) * TILE + row % TILE] = T::from_f64(value);
            }
        }
    }

    /// Solves W y = b.
    pub(super) fn solve(
        &self,
        right_side: &VectorField<T>,
        solution: &mut VectorField<T>,
        arch: pulp::Arch,
    ) {
        let margin = right_side.margin();
        let source = right_side.padded().map(|values| &values[margin..margin + self.count]);
        let tiles = self.tiles.par_chunks(BLOCK * self.count);
        solution.chunks_mut(BLOCK).zip(tiles).for_each(|(rows, tiles)| {
            arch.dispatch(RowsTask { tiles, source, rows });
        });
    }
}

/// Some rows of the product, compiled for each instruction set.
struct RowsTask<'a, T> {
    tiles: &'a [T],
    source: [&'a [T]; 3],
    rows: [&'a mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for RowsTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let width = TILE * self.source[0].len();
        for (number, tile) in self.tiles.chunks_exact(width).enumerate() {
            let sums = tile_product(tile, self.source);
            for axis in 0..3 {
                self.rows[axis][number * TILE..][..TILE].copy_from_slice(&sums[axis]);
            }
        }
    }
}
