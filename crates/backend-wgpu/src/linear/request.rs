//! What is asked of a linear solver.

use cloth_core::{
    Error, ImplicitSettings, LinearMethod, LinearSettings, LinearStart, LinearStop, MatrixForm,
    Preconditioner, Result,
};

use crate::{
    fault::BACKEND,
    layout::{CALL_BLOCKS, CALL_ENERGY, CALL_FROM_SOLUTION, Call},
};

/// All solves of a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolveRequest {
    pub(crate) linear: LinearSettings,
    /// Where the first one starts.
    pub(crate) start: LinearStart,
    /// Solves at most.
    pub(crate) passes: u32,
}

impl SolveRequest {
    pub(crate) const fn new(settings: &ImplicitSettings, start: LinearStart) -> Self {
        Self { linear: settings.linear, start, passes: settings.constraint_passes }
    }
}

/// What the kernels of a solve are told.
pub(crate) fn call_of(linear: &LinearSettings, start: LinearStart) -> Call {
    let mut flags = 0;
    if linear.method == LinearMethod::Jacobi || linear.preconditioner == Preconditioner::Block {
        flags |= CALL_BLOCKS;
    }
    if start == LinearStart::Solution {
        flags |= CALL_FROM_SOLUTION;
    }
    if linear.stop == LinearStop::Energy {
        flags |= CALL_ENERGY;
    }
    Call {
        tolerance: linear.tolerance as f32,
        iterations_max: linear.iterations_max,
        flags,
        ..Call::default()
    }
}

/// # Errors
/// `Unsupported` for what a GPU gains nothing from, with what there is instead.
pub(crate) fn linear_check(linear: &LinearSettings) -> Result<()> {
    let unsupported = |feature: String| Err(Error::Unsupported { backend: BACKEND, feature });
    if !matches!(linear.method, LinearMethod::ConjugateGradient | LinearMethod::Jacobi) {
        let method = linear.method;
        return unsupported(format!("the linear solver {method} (it has cg and jacobi)"));
    }
    if linear.method == LinearMethod::ConjugateGradient {
        preconditioner_check(linear.preconditioner)?;
    }
    matrix_check(linear.matrix)
}

/// # Errors
/// `Unsupported` for what takes one particle after the other.
pub(crate) fn preconditioner_check(preconditioner: Preconditioner) -> Result<()> {
    use Preconditioner::{Block, Diagonal, Schwarz};
    if matches!(preconditioner, Diagonal | Block | Schwarz) {
        return Ok(());
    }
    let feature =
        format!("the preconditioner {preconditioner} (it has diagonal, block and schwarz)");
    Err(Error::Unsupported { backend: BACKEND, feature })
}

/// # Errors
/// `Unsupported` for all but the form that reads the fewest bytes.
pub(crate) fn matrix_check(form: MatrixForm) -> Result<()> {
    if form == MatrixForm::MatrixFree {
        return Ok(());
    }
    let feature = format!("the matrix form {form} (it has matrix-free)");
    Err(Error::Unsupported { backend: BACKEND, feature })
}
