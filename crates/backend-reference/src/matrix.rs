//! 3 x 3 matrices.

use std::ops::{Add, AddAssign};

use crate::{Number, Vector};

/// A matrix, row by row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matrix<N>(pub [Vector<N>; 3]);

impl<N: Number> Matrix<N> {
    /// Zero.
    pub const ZERO: Self = Self([Vector::ZERO; 3]);

    /// `factor` I.
    #[must_use]
    pub fn diagonal(factor: N) -> Self {
        Self::of_diagonal([factor; 3])
    }

    /// The matrix with these numbers on its diagonal.
    #[must_use]
    pub fn of_diagonal(entries: [N; 3]) -> Self {
        Self::from_entries(|row, column| if row == column { entries[row] } else { N::ZERO })
    }

    /// a b^T.
    #[must_use]
    pub fn outer(a: Vector<N>, b: Vector<N>) -> Self {
        Self::from_entries(|row, column| a.0[row] * b.0[column])
    }

    /// The matrix with these entries.
    pub fn from_entries(entry: impl Fn(usize, usize) -> N) -> Self {
        Self(std::array::from_fn(|row| Vector(std::array::from_fn(|k| entry(row, k)))))
    }

    /// Every entry times `factor`.
    #[must_use]
    pub fn scaled(self, factor: N) -> Self {
        Self(self.0.map(|row| row.scaled(factor)))
    }

    /// Minus the matrix.
    #[must_use]
    pub fn negated(self) -> Self {
        Self(self.0.map(|row| Vector(row.0.map(|entry| -entry))))
    }

    /// Product with a vector.
    #[must_use]
    pub fn apply(self, vector: Vector<N>) -> Vector<N> {
        Vector(self.0.map(|row| row.dot(vector)))
    }

    /// Product with a matrix.
    #[must_use]
    pub fn product(self, other: Self) -> Self {
        Self::from_entries(|row, column| {
            self.0[row].dot(Vector(other.0.map(|vector| vector.0[column])))
        })
    }

    /// Sum of the diagonal.
    #[must_use]
    pub fn trace(self) -> N {
        self.0[0].0[0] + self.0[1].0[1] + self.0[2].0[2]
    }

    /// x with A x = b for a matrix that is positive definite, from its Cholesky factors.
    #[must_use]
    pub fn solve(self, b: Vector<N>) -> Vector<N> {
        let mut factor = [[N::ZERO; 3]; 3];
        for row in 0..3 {
            for column in 0..=row {
                let mut rest = self.0[row].0[column];
                for (a, b) in factor[row].iter().zip(&factor[column]).take(column) {
                    rest = rest - *a * *b;
                }
                factor[row][column] = if row == column {
                    rest.sqrt()
                } else {
                    rest * (N::ONE / factor[column][column])
                };
            }
        }
        let mut x = b.0;
        for row in 0..3 {
            for k in 0..row {
                x[row] = x[row] - factor[row][k] * x[k];
            }
            x[row] = x[row] / factor[row][row];
        }
        for row in (0..3).rev() {
            for k in row + 1..3 {
                x[row] = x[row] - factor[k][row] * x[k];
            }
            x[row] = x[row] / factor[row][row];
        }
        Vector(x)
    }
}

impl<N: Number> Add for Matrix<N> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|row| self.0[row] + other.0[row]))
    }
}

impl<N: Number> AddAssign for Matrix<N> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
