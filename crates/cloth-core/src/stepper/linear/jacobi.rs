//! Damped block Jacobi.

use crate::{ImplicitKernels, LinearOutcome, LinearSettings, LinearStart, LinearVector, Result};

use super::{Begin, begin, residual_of};

/// Times that the damping factor may be halved; after that the iteration stops where it is.
const HALVINGS_MAX: u32 = 20;

/// Solves the system of [`conjugate_gradient`](super::conjugate_gradient) by y += omega S P^-1 r, P
/// the diagonal blocks.
///
/// It converges for every matrix that is a sum of masses and springs: 2 P - A is then positive
/// definite (NUMERICS §5), so that all eigenvalues of P^-1 A lie between 0 and 2. This is also
/// checked as it runs: r.P^-1 r must fall in every iteration, by the square of the spectral radius
/// of I - omega P^-1 A or more. Should it rise, rounding being the one way it can, omega is halved.
///
/// # Errors
/// Those of the stages.
pub fn jacobi<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    start: LinearStart,
) -> Result<LinearOutcome> {
    use LinearVector::{Preconditioned, Residual, Solution};
    let (reference, mut residual) = match begin(kernels, settings, start)? {
        Begin::Done(outcome) => return Ok(outcome),
        Begin::Iterate(progress) => progress.residuals(),
    };
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    let mut norm = kernels.vector_dot(Residual, Preconditioned)?;
    let mut omega = 1.0;
    let mut halvings = 0;
    for iteration in 0..=settings.iterations_max {
        let outcome = LinearOutcome {
            iterations: iteration,
            residual: residual / reference,
            energy: None,
            restarted: false,
            converged: residual <= settings.tolerance * reference,
            breakdown: !(residual.is_finite() && norm.is_finite()),
        };
        let done = outcome.converged || outcome.breakdown || norm == 0.0;
        if done || iteration == settings.iterations_max {
            return Ok(outcome);
        }
        kernels.vector_combine((omega, Preconditioned), (1.0, Solution))?;
        residual = residual_of(kernels, settings, Solution)?;
        kernels.preconditioner_apply(Residual, Preconditioned)?;
        let norm_before = norm;
        norm = kernels.vector_dot(Residual, Preconditioned)?;
        if norm >= norm_before {
            if halvings == HALVINGS_MAX {
                return Ok(LinearOutcome { residual: residual / reference, ..outcome });
            }
            halvings += 1;
            omega *= 0.5;
        }
    }
    Ok(LinearOutcome::default())
}
