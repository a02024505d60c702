//! Small dense matrices, for answers that need no iteration.

use cloth_core::MatrixBlock;

/// A square matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense {
    entries: Vec<f64>,
    size: usize,
}

impl Dense {
    /// Zero, `size` x `size`.
    #[must_use]
    pub fn zero(size: usize) -> Self {
        Self { entries: vec![0.0; size * size], size }
    }

    /// The matrix of these blocks, three rows for each of `particles`.
    #[must_use]
    pub fn from_blocks(blocks: &[MatrixBlock], particles: usize) -> Self {
        let mut dense = Self::zero(3 * particles);
        for block in blocks {
            for (row, entries) in block.entries.iter().enumerate() {
                for (column, entry) in entries.iter().enumerate() {
                    *dense.at(3 * block.row as usize + row, 3 * block.column as usize + column) +=
                        entry;
                }
            }
        }
        dense
    }

    /// An entry, to read or write.
    pub fn at(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.entries[row * self.size + column]
    }

    /// A row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.size..(row + 1) * self.size]
    }

    /// Rows and columns.
    #[must_use]
    pub const fn size(&self) -> usize {
        self.size
    }

    /// Product with a vector.
    #[must_use]
    pub fn apply(&self, vector: &[f64]) -> Vec<f64> {
        let dot = |row| self.row(row).iter().zip(vector).map(|(a, b)| a * b).sum();
        (0..self.size).map(dot).collect()
    }

    /// Largest |a_ij - a_ji| relative to the larger of the two diagonal entries.
    #[must_use]
    pub fn asymmetry(&self) -> f64 {
        let mut largest = 0.0_f64;
        for row in 0..self.size {
            for column in 0..row {
                let difference = (self.row(row)[column] - self.row(column)[row]).abs();
                let scale = self.row(row)[row].abs().max(self.row(column)[column].abs());
                largest = largest.max(difference / scale);
            }
        }
        largest
    }

    /// The Cholesky factor, lower triangle; `None` if the matrix is not positive definite.
    #[must_use]
    pub fn cholesky(&self) -> Option<Self> {
        let mut factor = Self::zero(self.size);
        for row in 0..self.size {
            for column in 0..=row {
                let [a, b] = [row, column].map(|r| &factor.row(r)[..column]);
                let products: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let rest = self.row(row)[column] - products;
                let pivot = factor.row(column)[column];
                *factor.at(row, column) = if row == column {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return None;
                    }
                    rest.sqrt()
                } else {
                    rest / pivot
                };
            }
        }
        Some(factor)
    }

    /// x with A x = b, by Gaussian elimination with partial pivoting.
    #[must_use]
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let (mut a, mut x) = (self.clone(), b.to_vec());
        for step in 0..self.size {
            let size = |row: usize| a.row(row)[step].abs();
            let pivot =
                (step..self.size).fold(step, |p, row| if size(row) > size(p) { row } else { p });
            for column in 0..self.size {
                let [upper, lower] = [a.row(step)[column], a.row(pivot)[column]];
                *a.at(step, column) = lower;
                *a.at(pivot, column) = upper;
            }
            x.swap(step, pivot);
            for row in step + 1..self.size {
                let factor = a.row(row)[step] / a.row(step)[step];
                if factor != 0.0 {
                    for column in step..self.size {
                        *a.at(row, column) -= factor * a.row(step)[column];
                    }
                    x[row] -= factor * x[step];
                }
            }
        }
        for row in (0..self.size).rev() {
            let known: f64 = (row + 1..self.size).map(|k| a.row(row)[k] * x[k]).sum();
            x[row] = (x[row] - known) / a.row(row)[row];
        }
        x
    }
}

/// Components of all vectors in a row.
#[must_use]
pub fn flat(vectors: &[[f64; 3]]) -> Vec<f64> {
    vectors.iter().flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn factor_and_solution_fit_the_matrix() {
        let mut random = Random::new(5);
        let mut a = Dense::zero(6);
        for row in 0..6 {
            for column in 0..=row {
                let entry = random.between(-1.0, 1.0) + if row == column { 6.0 } else { 0.0 };
                *a.at(row, column) = entry;
                *a.at(column, row) = entry;
            }
        }
        let factor = a.cholesky();
        assert!(factor.is_some());
        let b: Vec<f64> = (0..6).map(|_| random.between(-1.0, 1.0)).collect();
        let image = a.apply(&a.solve(&b));
        assert!(image.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-14));
        if let Some(factor) = factor {
            for row in 0..6 {
                for column in 0..6 {
                    let product: f64 =
                        factor.row(row).iter().zip(factor.row(column)).map(|(a, b)| a * b).sum();
                    assert!((product - a.row(row)[column]).abs() < 1e-14);
                }
            }
        }
        *a.at(3, 3) = -1.0;
        assert!(a.cholesky().is_none());
    }
}
