//! The modified preconditioned conjugate gradient method.

use crate::{ImplicitKernels, LinearOutcome, LinearSettings, LinearStart, LinearVector, Result};

use super::{Begin, begin};

/// Solves S A S y = S b with y = z in the constrained directions (Ascher and Boxerman 2003), in the
/// form with one pass of reductions for each iteration (Chronopoulos and Gear 1989): the image of
/// the direction is carried along instead of computed.
///
/// # Errors
/// Those of the stages.
pub fn conjugate_gradient<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    start: LinearStart,
) -> Result<LinearOutcome> {
    use LinearVector::{Direction, DirectionImage, Image, Preconditioned, Residual, Solution};
    let (reference, mut residual) = match begin(kernels, settings, start)? {
        Begin::Done(outcome) => return Ok(outcome),
        Begin::Iterate { reference, residual } => (reference, residual),
    };
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    let mut gamma = kernels.vector_dot(Residual, Preconditioned)?;
    let mut recurrence = Recurrence::default();
    for iteration in 0..=settings.iterations_max {
        let outcome = LinearOutcome {
            iterations: iteration,
            residual: residual / reference,
            converged: residual <= settings.tolerance * reference,
            breakdown: !(residual.is_finite() && gamma.is_finite()),
        };
        let done = outcome.converged || outcome.breakdown || gamma == 0.0;
        if done || iteration == settings.iterations_max {
            return Ok(outcome);
        }
        kernels.matrix_apply(settings.matrix, Preconditioned, Image)?;
        kernels.constraint_filter(Image)?;
        let delta = kernels.vector_dot(Preconditioned, Image)?;
        let Some((alpha, beta)) = recurrence.advance(gamma, delta) else {
            return Ok(LinearOutcome { breakdown: iteration == 0, ..outcome });
        };
        kernels.vector_combine((1.0, Preconditioned), (beta, Direction))?;
        kernels.vector_combine((1.0, Image), (beta, DirectionImage))?;
        kernels.vector_combine((alpha, Direction), (1.0, Solution))?;
        kernels.vector_combine((-alpha, DirectionImage), (1.0, Residual))?;
        kernels.preconditioner_apply(Residual, Preconditioned)?;
        gamma = kernels.vector_dot(Residual, Preconditioned)?;
        residual = kernels.vector_dot(Residual, Residual)?.sqrt();
    }
    Ok(LinearOutcome::default())
}

/// The scalars that are carried from one iteration to the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recurrence {
    alpha: f64,
    gamma: f64,
}

impl Recurrence {
    /// Step length alpha and direction factor beta from gamma = r.c and delta = c.A c; `None` if
    /// the curvature along the direction is not positive, by rounding once the residual cannot get
    /// smaller, or because the matrix is not positive definite.
    pub fn advance(&mut self, gamma: f64, delta: f64) -> Option<(f64, f64)> {
        let (beta, curvature) = if self.alpha == 0.0 {
            (0.0, delta)
        } else {
            let beta = gamma / self.gamma;
            (beta, delta - beta * gamma / self.alpha)
        };
        let alpha = gamma / curvature;
        if !(curvature > 0.0 && alpha.is_finite()) {
            return None;
        }
        *self = Self { alpha, gamma };
        Some((alpha, beta))
    }
}
