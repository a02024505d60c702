//! Sparse Cholesky factorisation, by faer.

use faer::{
    Mat, Side,
    linalg::solvers::Solve,
    sparse::{SparseColMat, Triplet, linalg::solvers::Llt},
};

/// A factorised matrix.
pub(crate) struct SparseCholesky {
    factors: Llt<usize, f64>,
    size: usize,
}

impl SparseCholesky {
    /// Factorises the symmetric matrix with these entries of the lower triangle: row, column, number. Entries of one place are
    /// added up. `None` if it is not positive definite to rounding, or a number of it is not finite.
    pub(crate) fn new(size: usize, entries: &[(usize, usize, f64)]) -> Option<Self> {
        if entries.iter().any(|entry| !entry.2.is_finite()) {
            return None;
        }
        let triplets: Vec<_> =
            entries.iter().map(|&(row, column, value)| Triplet::new(row, column, value)).collect();
        let matrix = SparseColMat::try_new_from_triplets(size, size, &triplets).ok()?;
        Some(Self { factors: matrix.sp_cholesky(Side::Lower).ok()?, size })
    }

    /// Solves for `COUNT` right-hand sides at once: entry i of `right_side` has row i of each.
    pub(crate) fn solve<const COUNT: usize>(
        &self,
        right_side: &[[f64; COUNT]],
    ) -> Vec<[f64; COUNT]> {
        let mut columns = Mat::from_fn(self.size, COUNT, |row, column| right_side[row][column]);
        self.factors.solve_in_place(&mut columns);
        (0..self.size).map(|row| std::array::from_fn(|column| columns[(row, column)])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_solved_or_refused() {
        let entries = |corner| [(0, 0, 4.0), (1, 0, 1.0), (1, 0, 1.0), (1, 1, corner)];
        let solver = SparseCholesky::new(2, &entries(3.0)).unwrap();
        let [x, y] = solver.solve(&[[8.0], [5.0]]).try_into().unwrap();
        assert!((x[0] - 1.75).abs() < 1e-15 && (y[0] - 0.5).abs() < 1e-15, "{x:?} {y:?}");
        for corner in [0.5, -3.0, f64::NAN, f64::INFINITY] {
            assert!(SparseCholesky::new(2, &entries(corner)).is_none(), "{corner}");
        }
    }
}
