//! Sparse Cholesky factorisation of the matrix of an implicit step, by faer.

use cloth_core::MatrixBlock;
use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{
        SparseColMat, Triplet,
        linalg::solvers::{Llt, SymbolicLlt},
    },
};

/// A factorisation for particles of which some are held, analysed once.
pub(super) struct Factorisation {
    /// The first of the three rows of each particle that is free.
    rows: Vec<Option<usize>>,
    size: usize,
    symbolic: Option<SymbolicLlt<usize>>,
}

impl Factorisation {
    pub(super) fn new(held: &[u8]) -> Self {
        let mut size = 0;
        let row = |&held: &u8| {
            (held == 0).then(|| {
                size += 3;
                size - 3
            })
        };
        Self { rows: held.iter().map(row).collect(), size, symbolic: None }
    }

    /// The solution for all particles, zero for those that are held, with a diagonal that is larger by the share `shift`. `None` if the matrix is not positive definite to rounding, or a number
    /// is not finite.
    pub(super) fn solve(
        &mut self,
        blocks: &[MatrixBlock],
        right_side: &[[f64; 3]],
        shift: f64,
    ) -> Option<Vec<[f64; 3]>> {
        let mut triplets = Vec::with_capacity(9 * blocks.len());
        for block in blocks {
            let place = |particle: u32| self.rows[particle as usize];
            let (Some(row), Some(column)) = (place(block.row), place(block.column)) else {
                continue;
            };
            for (i, entries) in block.entries.iter().enumerate() {
                for (j, &entry) in entries.iter().enumerate() {
                    if !entry.is_finite() {
                        return None;
                    }
                    if row + i >= column + j {
                        let is_diagonal = row + i == column + j;
                        let entry = if is_diagonal { (1.0 + shift) * entry } else { entry };
                        triplets.push(Triplet::new(row + i, column + j, entry));
                    }
                }
            }
        }
        let matrix = SparseColMat::try_new_from_triplets(self.size, self.size, &triplets).ok()?;
        if self.symbolic.is_none() {
            self.symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).ok();
        }
        // All models of a laboratory keep their pattern.
        let symbolic = self.symbolic.clone()?;
        let factors = Llt::try_new_with_symbolic(symbolic, matrix.as_ref(), Side::Lower).ok()?;
        let mut column = Mat::<f64>::zeros(self.size, 1);
        for (row, entry) in self.rows.iter().zip(right_side) {
            if let &Some(row) = row {
                (0..3).for_each(|k| column[(row + k, 0)] = entry[k]);
            }
        }
        factors.solve_in_place(&mut column);
        let read = |row: &Option<usize>| {
            row.map_or([0.0; 3], |row| std::array::from_fn(|k| column[(row + k, 0)]))
        };
        Some(self.rows.iter().map(read).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_particle_does_not_move_and_the_others_solve_the_system() {
        let diagonal = |k: f64| [[k, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, k]];
        let block = |row, column, k| MatrixBlock { row, column, entries: diagonal(k) };
        let blocks = [
            block(0, 0, 2.0),
            block(0, 1, -1.0),
            block(1, 0, -1.0),
            block(1, 1, 4.0),
            block(2, 2, 1.0),
        ];
        let mut factorisation = Factorisation::new(&[0, 0, 1]);
        for _ in 0..2 {
            let solution =
                factorisation.solve(&blocks, &[[1.0; 3], [3.0; 3], [9.0; 3]], 0.0).unwrap();
            for (found, expected) in solution.iter().zip([1.0, 1.0, 0.0]) {
                assert!((found[1] - expected).abs() < 1e-15);
            }
        }
        assert!(
            factorisation
                .solve(&[block(0, 0, -1.0), block(1, 1, 1.0)], &[[1.0; 3]; 3], 0.0)
                .is_none()
        );
        assert!(
            Factorisation::new(&[0]).solve(&[block(0, 0, f64::NAN)], &[[1.0; 3]], 0.0).is_none()
        );
    }
    /// A chain that is free at both ends has no stiffness against being moved: less than nothing, once rounding has taken from its diagonal.
    #[test]
    fn a_shift_mends_what_rounding_took() {
        let diagonal = |k: f64| [[k, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, k]];
        let block = |row, column, k| MatrixBlock { row, column, entries: diagonal(k) };
        let rounded = 1.0 - 1e-8;
        let blocks =
            [block(0, 0, rounded), block(0, 1, -1.0), block(1, 0, -1.0), block(1, 1, rounded)];
        let pull = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
        let mut factorisation = Factorisation::new(&[0, 0]);
        assert!(factorisation.solve(&blocks, &pull, 0.0).is_none());
        let solution = factorisation.solve(&blocks, &pull, 1e-7).unwrap();
        assert!((solution[0][0] - 0.5).abs() < 1e-6 && (solution[1][0] + 0.5).abs() < 1e-6);
    }
}
