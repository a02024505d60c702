//! Solvers of the linear system of an implicit step (NUMERICS §5), each written once over the stages
//! of [`ImplicitKernels`].

mod conjugate_gradient;
mod jacobi;

pub use conjugate_gradient::{Recurrence, conjugate_gradient};
pub use jacobi::jacobi;

use crate::{
    ImplicitKernels, LinearMethod, LinearOutcome, LinearSettings, LinearVector, Preconditioner,
    Result,
};

/// A solver of A y = b under constraints.
///
/// The matrix, b and the constraints are in place; the solution holds a start that meets the
/// constraints, and the answer afterwards.
pub trait LinearSolver<K: ImplicitKernels + ?Sized> {
    /// Makes what a solve needs of the present matrix and constraints.
    ///
    /// # Errors
    /// Those of the stages.
    fn prepare(&self, kernels: &mut K, settings: &LinearSettings) -> Result<()>;

    /// Solves the system.
    ///
    /// # Errors
    /// Those of the stages. A solve that fails as mathematics is no error but a
    /// [`LinearOutcome::breakdown`].
    fn solve(&self, kernels: &mut K, settings: &LinearSettings) -> Result<LinearOutcome>;
}

impl LinearMethod {
    /// The solver of this name.
    #[must_use]
    pub fn solver<'k, K: ImplicitKernels + ?Sized + 'k>(self) -> &'k dyn LinearSolver<K> {
        match self {
            Self::ConjugateGradient => &ConjugateGradient,
            Self::Jacobi => &Jacobi,
            Self::Direct => &Direct,
        }
    }
}

struct ConjugateGradient;
struct Jacobi;
struct Direct;

impl<K: ImplicitKernels + ?Sized> LinearSolver<K> for ConjugateGradient {
    fn prepare(&self, kernels: &mut K, settings: &LinearSettings) -> Result<()> {
        kernels.preconditioner_build(settings.preconditioner)
    }

    fn solve(&self, kernels: &mut K, settings: &LinearSettings) -> Result<LinearOutcome> {
        kernels.conjugate_gradient(settings)
    }
}

impl<K: ImplicitKernels + ?Sized> LinearSolver<K> for Jacobi {
    fn prepare(&self, kernels: &mut K, _: &LinearSettings) -> Result<()> {
        kernels.preconditioner_build(Preconditioner::Block)
    }

    fn solve(&self, kernels: &mut K, settings: &LinearSettings) -> Result<LinearOutcome> {
        kernels.jacobi(settings)
    }
}

impl<K: ImplicitKernels + ?Sized> LinearSolver<K> for Direct {
    fn prepare(&self, _: &mut K, _: &LinearSettings) -> Result<()> {
        Ok(())
    }

    fn solve(&self, kernels: &mut K, _: &LinearSettings) -> Result<LinearOutcome> {
        kernels.direct_solve()
    }
}

/// r = S (b - A y) for a vector y; uses the image. Returns |r|.
fn residual_of<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    vector: LinearVector,
) -> Result<f64> {
    use LinearVector::{Image, Residual, RightSide};
    kernels.matrix_apply(settings.matrix, vector, Image)?;
    kernels.vector_combine((1.0, RightSide), (0.0, Residual))?;
    kernels.vector_combine((-1.0, Image), (1.0, Residual))?;
    kernels.constraint_filter(Residual)?;
    Ok(kernels.vector_dot(Residual, Residual)?.sqrt())
}

/// |S (b - A z)|, the residual of the vector that does nothing but meet the constraints: what
/// relative residuals are relative to. Uses image and residual, and leaves z as the direction.
fn reference_residual<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
) -> Result<f64> {
    use LinearVector::{Direction, RightSide};
    kernels.vector_combine((0.0, RightSide), (0.0, Direction))?;
    kernels.constraint_project(Direction)?;
    residual_of(kernels, settings, Direction)
}

/// The outcome for a system whose answer is z: nothing is left to solve.
fn nothing_to_solve<K: ImplicitKernels + ?Sized>(kernels: &mut K) -> Result<LinearOutcome> {
    kernels.vector_combine((1.0, LinearVector::Direction), (0.0, LinearVector::Solution))?;
    Ok(LinearOutcome { converged: true, ..LinearOutcome::default() })
}

/// The outcome for a system with numbers that are not finite.
fn not_a_system() -> LinearOutcome {
    LinearOutcome { residual: f64::INFINITY, breakdown: true, ..LinearOutcome::default() }
}
