//! Solvers of the linear system of an implicit step (NUMERICS §5), each written once over the stages
//! of [`ImplicitKernels`].

mod block_sum;
mod conjugate_gradient;
mod energy;
mod jacobi;
mod progress;

pub use block_sum::block_sum;
pub use conjugate_gradient::{Recurrence, conjugate_gradient, restart};
pub use jacobi::jacobi;
pub use progress::{Next, Progress, restarts};

use crate::{
    ImplicitKernels, LinearMethod, LinearOutcome, LinearSettings, LinearStart, LinearStop,
    LinearVector, Preconditioner, Result,
};

/// A solver of A y = b under constraints.
///
/// The matrix, b and the constraints are in place; the solution holds the answer afterwards.
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
    fn solve(
        &self,
        kernels: &mut K,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome>;
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

    fn solve(
        &self,
        kernels: &mut K,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        kernels.conjugate_gradient(settings, start)
    }
}

impl<K: ImplicitKernels + ?Sized> LinearSolver<K> for Jacobi {
    fn prepare(&self, kernels: &mut K, _: &LinearSettings) -> Result<()> {
        kernels.preconditioner_build(Preconditioner::Block)
    }

    fn solve(
        &self,
        kernels: &mut K,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<LinearOutcome> {
        kernels.jacobi(settings, start)
    }
}

impl<K: ImplicitKernels + ?Sized> LinearSolver<K> for Direct {
    fn prepare(&self, _: &mut K, _: &LinearSettings) -> Result<()> {
        Ok(())
    }

    fn solve(&self, kernels: &mut K, _: &LinearSettings, _: LinearStart) -> Result<LinearOutcome> {
        kernels.direct_solve()
    }
}

/// How an iteration begins.
#[expect(clippy::large_enum_variant, reason = "one for each solve, which is taken apart at once")]
pub enum Begin {
    /// There is nothing left to do.
    Done(LinearOutcome),
    /// There is.
    Iterate(Progress),
}

/// Puts the solution where an iteration starts, and its residual with it. Uses image and direction.
///
/// # Errors
/// Those of the stages.
pub fn begin<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    start: LinearStart,
) -> Result<Begin> {
    use LinearVector::{Direction, Residual, RightSide, Solution};
    kernels.vector_combine((0.0, RightSide), (0.0, Direction))?;
    kernels.constraint_project(Direction)?;
    let reference = if kernels.vector_dot(Direction, Direction)? == 0.0 {
        kernels.vector_combine((1.0, RightSide), (0.0, Residual))?;
        kernels.constraint_filter(Residual)?;
        kernels.vector_dot(Residual, Residual)?.sqrt()
    } else {
        residual_of(kernels, settings, Direction)?
    };
    if reference == 0.0 || start == LinearStart::Constraints {
        kernels.vector_combine((1.0, Direction), (0.0, Solution))?;
    }
    if reference == 0.0 {
        return Ok(Begin::Done(LinearOutcome { converged: true, ..LinearOutcome::default() }));
    }
    // (y - z) A (y - z) + 2 (y - z) r = (y - z) (r_z + r) of the start y: what it is closer than z.
    let mut closer = 0.0;
    let residual = if start == LinearStart::Constraints {
        reference
    } else {
        let measures = settings.stop == LinearStop::Energy;
        kernels.constraint_project(Solution)?;
        if measures {
            closer += step_times_residual(kernels)?;
        }
        let residual = residual_of(kernels, settings, Solution)?;
        if measures {
            closer += step_times_residual(kernels)?;
        }
        residual
    };
    if !(reference.is_finite() && residual.is_finite()) {
        let outcome = LinearOutcome { breakdown: true, ..LinearOutcome::default() };
        return Ok(Begin::Done(LinearOutcome { residual: f64::INFINITY, ..outcome }));
    }
    Ok(Begin::Iterate(Progress::new(settings, [reference, residual, closer])))
}

/// (y - z) r, z as the direction.
fn step_times_residual<K: ImplicitKernels + ?Sized>(kernels: &mut K) -> Result<f64> {
    use LinearVector::{Direction, Residual, Solution};
    Ok(kernels.vector_dot(Solution, Residual)? - kernels.vector_dot(Direction, Residual)?)
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
