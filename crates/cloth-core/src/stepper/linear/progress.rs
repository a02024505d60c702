//! How far the conjugate gradient method has come, and what it does next: the same for all ways to run it.

use crate::{LinearOutcome, LinearSettings, LinearStop, Preconditioner};

use super::{Recurrence, energy::EnergyEstimate};

/// The scalars of a solve by conjugate gradients.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    settings: LinearSettings,
    reference: f64,
    residual: f64,
    iterations: u32,
    recurrence: Recurrence,
    energy: EnergyEstimate,
    restarted: bool,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// Another iteration.
    Iterate,
    /// Preconditioner or matrix have turned out to be indefinite, by rounding: build the preconditioner `diagonal`, compute the
    /// residual of the present solution, call [`Progress::restart`], and go on.
    Restart,
    /// Nothing.
    Done(LinearOutcome),
}

impl Progress {
    /// Before the first iteration: |S (b - A z)|, |r| of the first solution, and how much closer that is than z in the
    /// square of the norm of the energy.
    #[must_use]
    pub const fn new(settings: &LinearSettings, [reference, residual, closer]: [f64; 3]) -> Self {
        Self {
            settings: *settings,
            reference,
            residual,
            iterations: 0,
            recurrence: Recurrence { alpha: 0.0, gamma: 0.0 },
            energy: EnergyEstimate::new(closer),
            restarted: false,
        }
    }

    /// |S (b - A z)|, what relative residuals are relative to, and the present |r|.
    #[must_use]
    pub const fn residuals(&self) -> (f64, f64) {
        (self.reference, self.residual)
    }

    /// What comes next, with gamma = r . c of the present residual.
    #[must_use]
    pub fn next(&self, gamma: f64) -> Next {
        let residual = self.residual / self.reference;
        let energy = self.energy.relative();
        let tolerance = self.settings.tolerance;
        let converged = match self.settings.stop {
            LinearStop::Residual => self.residual <= tolerance * self.reference,
            LinearStop::Energy => {
                self.residual == 0.0 || energy.is_some_and(|energy| energy <= tolerance)
            }
        };
        let outcome = LinearOutcome {
            iterations: self.iterations,
            residual,
            energy,
            restarted: self.restarted,
            converged,
            breakdown: !(self.residual.is_finite() && gamma.is_finite()),
        };
        let is_at_end = self.iterations >= self.settings.iterations_max;
        // Not so if it is not a number, either.
        let is_definite = gamma > 0.0;
        if !(outcome.converged || is_at_end || is_definite) && self.may_restart() {
            return Next::Restart;
        }
        if outcome.converged || outcome.breakdown || gamma == 0.0 || is_at_end {
            return Next::Done(outcome);
        }
        Next::Iterate
    }

    /// The factors alpha and beta of an iteration, from gamma = r . c and delta = c . A c.
    ///
    /// # Errors
    /// What to do instead, where the curvature along the direction is not positive.
    pub fn advance(&mut self, gamma: f64, delta: f64) -> Result<(f64, f64), Next> {
        let Some((alpha, beta)) = self.recurrence.advance(gamma, delta) else {
            if self.may_restart() {
                return Err(Next::Restart);
            }
            return Err(Next::Done(LinearOutcome {
                iterations: self.iterations,
                residual: self.residual / self.reference,
                energy: self.energy.relative(),
                restarted: self.restarted,
                converged: false,
                breakdown: self.iterations == 0,
            }));
        };
        self.energy.add(alpha * gamma);
        Ok((alpha, beta))
    }

    /// Ends an iteration that left this residual.
    pub const fn end(&mut self, residual: f64) {
        self.residual = residual;
        self.iterations += 1;
    }

    /// Begins anew with the residual of the present solution.
    pub const fn restart(&mut self, residual: f64) {
        self.residual = residual;
        self.recurrence = Recurrence { alpha: 0.0, gamma: 0.0 };
        self.restarted = true;
    }

    fn may_restart(&self) -> bool {
        !self.restarted && restarts(self.settings.preconditioner, self.residual / self.reference)
    }
}

/// What is left of a residual at which a solve stands as it is, where rounding lets it go no further.
const STANDS: f64 = 1e-2;

/// Whether a solve that meets a direction without positive curvature goes on with the preconditioner `diagonal`, with this relative
/// residual: blocks lose in their inverses what is stiff beyond the precision, and `schwarz` may be of another matrix.
#[must_use]
pub fn restarts(preconditioner: Preconditioner, residual: f64) -> bool {
    match preconditioner {
        Preconditioner::Diagonal => false,
        Preconditioner::Schwarz => residual > 0.0,
        _ => residual > STANDS,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(preconditioner: Preconditioner) -> Progress {
        let settings = LinearSettings { preconditioner, ..LinearSettings::default() };
        Progress::new(&settings, [1.0, 1.0, 0.0])
    }

    #[test]
    fn an_indefinite_preconditioner_is_left_once() {
        let mut schwarz = progress(Preconditioner::Schwarz);
        assert_eq!(schwarz.next(1.0), Next::Iterate);
        for gamma in [-1.0, 0.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(schwarz.next(gamma), Next::Restart);
        }
        assert_eq!(schwarz.advance(1.0, -1.0), Err(Next::Restart));
        schwarz.restart(1.0);
        let Err(Next::Done(outcome)) = schwarz.advance(1.0, -1.0) else { panic!() };
        assert!(outcome.breakdown && outcome.restarted);
        assert!(matches!(
            schwarz.next(f64::NAN),
            Next::Done(LinearOutcome { breakdown: true, .. })
        ));
        let mut diagonal = progress(Preconditioner::Diagonal);
        let Err(Next::Done(outcome)) = diagonal.advance(1.0, -1.0) else { panic!() };
        assert!(outcome.breakdown && !outcome.restarted);
        let mut block = progress(Preconditioner::Block);
        assert_eq!(block.advance(1.0, -1.0), Err(Next::Restart));
        block.end(1e-3);
        let Err(Next::Done(outcome)) = block.advance(1.0, -1.0) else { panic!() };
        assert!(!outcome.breakdown && !outcome.restarted, "most is there, and stands");
    }

    #[test]
    fn a_residual_that_is_not_finite_is_a_breakdown() {
        let mut schwarz = progress(Preconditioner::Schwarz);
        schwarz.end(f64::NAN);
        assert!(matches!(schwarz.next(1.0), Next::Done(LinearOutcome { breakdown: true, .. })));
    }
}
