//! The linear solvers under test. A test of what they have in common runs through these lists, so
//! that a solver that is added to them is held to all of it.

use cloth_core::{LinearMethod, MatrixForm, Preconditioner};

/// Methods that every backend under test has.
pub const LINEAR_METHODS: &[LinearMethod] =
    &[LinearMethod::ConjugateGradient, LinearMethod::Jacobi, LinearMethod::Direct];

/// Preconditioners that every backend under test has.
pub const PRECONDITIONERS: &[Preconditioner] = &[
    Preconditioner::Diagonal,
    Preconditioner::Block,
    Preconditioner::IncompleteCholesky,
    Preconditioner::Schwarz,
];

/// Forms of the matrix that every backend under test has.
pub const MATRIX_FORMS: &[MatrixForm] = &[MatrixForm::MatrixFree, MatrixForm::Assembled];
