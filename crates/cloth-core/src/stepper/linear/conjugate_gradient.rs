//! The modified preconditioned conjugate gradient method.

use crate::{
    ImplicitKernels, LinearOutcome, LinearSettings, LinearStart, LinearVector, Preconditioner,
    Result,
};

use super::{Begin, Next, Progress, begin, residual_of};

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
    let mut progress = match begin(kernels, settings, start)? {
        Begin::Done(outcome) => return Ok(outcome),
        Begin::Iterate(progress) => progress,
    };
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    let mut gamma = kernels.vector_dot(Residual, Preconditioned)?;
    loop {
        let mut next = progress.next(gamma);
        if next == Next::Iterate {
            kernels.matrix_apply(settings.matrix, Preconditioned, Image)?;
            kernels.constraint_filter(Image)?;
            let delta = kernels.vector_dot(Preconditioned, Image)?;
            match progress.advance(gamma, delta) {
                Ok((alpha, beta)) => {
                    kernels.vector_combine((1.0, Preconditioned), (beta, Direction))?;
                    kernels.vector_combine((1.0, Image), (beta, DirectionImage))?;
                    kernels.vector_combine((alpha, Direction), (1.0, Solution))?;
                    kernels.vector_combine((-alpha, DirectionImage), (1.0, Residual))?;
                    kernels.preconditioner_apply(Residual, Preconditioned)?;
                    gamma = kernels.vector_dot(Residual, Preconditioned)?;
                    progress.end(kernels.vector_dot(Residual, Residual)?.sqrt());
                }
                Err(instead) => next = instead,
            }
        }
        match next {
            Next::Iterate => {}
            Next::Restart => gamma = restart(kernels, settings, &mut progress)?,
            Next::Done(outcome) => return Ok(outcome),
        }
    }
}

/// Begins anew from the present solution with the diagonal as preconditioner. Returns r . c.
///
/// # Errors
/// Those of the stages.
pub fn restart<K: ImplicitKernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    progress: &mut Progress,
) -> Result<f64> {
    use LinearVector::{Preconditioned, Residual, Solution};
    kernels.preconditioner_build(Preconditioner::Diagonal)?;
    progress.restart(residual_of(kernels, settings, Solution)?);
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    kernels.vector_dot(Residual, Preconditioned)
}

/// The scalars that are carried from one iteration to the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recurrence {
    pub(super) alpha: f64,
    pub(super) gamma: f64,
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
