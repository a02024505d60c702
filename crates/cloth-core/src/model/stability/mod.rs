//! How large a time step may be (NUMERICS §4 and §6).

mod fabric;
mod lanczos;
mod operators;

use crate::{Integrator, contact::EXPLICIT_EIGENVALUE};

use super::Model;
use lanczos::largest_eigenvalue;
use operators::{AnyShape, Coefficients, RestShape};

/// Springs visited in all products together at most, some seconds of work; a model so large gets
/// fewer products and a wider margin.
const VISITS: usize = 400_000_000;

/// Springs that take as long as a triangle of fabric.
const ELEMENT_VISITS: usize = 20;

/// Products with the matrix in one estimate, fewest and most.
const STEPS: [usize; 2] = [24, 64];

/// Estimates on the way to a time step.
const ROUNDS: usize = 6;

/// Where they start \[s\].
const START: f64 = 1e-4;

/// Largest eigenvalue of h^2 K + 2 h C by M with which symplectic Euler is stable.
const LIMIT: f64 = 4.0;

/// Largest time step that is told \[s\]: nothing that acts limits it.
const LONGEST: f64 = 1e3;

impl Model {
    /// A time step \[s\] up to which symplectic Euler is stable in whatever shape the cloth is,
    /// stretched, folded or lying on itself, with dampers, drag, air and contact, and with any particles held; at most
    /// 1000 s.
    ///
    /// It is the h at which the largest eigenvalue of h^2 K + 2 h C, by M, is 4 (NUMERICS §4 has
    /// the proof), with matrices K and C that no state exceeds: each spring counts with the steepest part of its tension and
    /// its damper in all directions at once. The eigenvalue is that of a
    /// Lanczos iteration from a random start, and a margin that it misses with a probability below 1e-6 (Kuczyński and
    /// Woźniakowski 1992).
    ///
    /// Assumed are: a particle in contact by penalty has the partners of two layers of cloth, as
    /// dense as at rest ([`ContactResponse::Penalty`](crate::ContactResponse)); the air moves
    /// by at most the wind of the model, gusts included, and 10 m/s more past the cloth; procedural fields do not depend
    /// on place and velocity.
    #[must_use]
    pub fn stable_time_step(&self) -> f64 {
        let mut operator = AnyShape::new(self, Coefficients::All);
        let limit = LIMIT - self.contact_eigenvalue();
        self.longest_step(self.particle_count(), limit, |h, x, y| operator.apply(h, x, y))
    }

    /// What contact of triangles takes of the limit, whatever the step: its stiffness follows it (NUMERICS §15).
    fn contact_eigenvalue(&self) -> f64 {
        if self.has_triangle_contact() { EXPLICIT_EIGENVALUE } else { 0.0 }
    }

    /// The time step \[s\] above which symplectic Euler is unstable even while the cloth is as at the
    /// start and touches nothing: the same limit, for springs that act only along their direction at rest. Between [`Self::stable_time_step`] and this
    /// one it depends on the shape; at most 1000 s.
    #[must_use]
    pub fn stable_time_step_at_rest(&self) -> f64 {
        let mut operator = RestShape::new(self);
        self.longest_step(3 * self.particle_count(), LIMIT, |h, x, y| operator.apply(h, x, y))
    }

    /// The time step \[s\] up to which an integrator is stable, or `None` if it is at any.
    ///
    /// The semi-implicit one treats contact by penalty, drag and air as the explicit one does, without a
    /// matrix for them: these limit it (NUMERICS §6). Stable is not accurate: what the large steps of the implicit
    /// ones damp, [`integrators`](crate::integrators) says.
    #[must_use]
    pub fn stable_time_step_of(&self, integrator: &Integrator) -> Option<f64> {
        match integrator {
            Integrator::Explicit => Some(self.stable_time_step()),
            Integrator::Implicit(_) | Integrator::Midpoint(_) => None,
            Integrator::SemiImplicit(_) => {
                let mut operator = AnyShape::new(self, Coefficients::WithoutSprings);
                let limit = LIMIT - self.contact_eigenvalue();
                let count = self.particle_count();
                let step = self.longest_step(count, limit, |h, x, y| operator.apply(h, x, y));
                (step < LONGEST).then_some(step)
            }
        }
    }

    /// The largest h for which the eigenvalues of h^2 K + 2 h C by M are at most `limit`. `apply`
    /// multiplies by this matrix, made symmetric.
    fn longest_step(
        &self,
        size: usize,
        limit: f64,
        mut apply: impl FnMut(f64, &[f64], &mut [f64]),
    ) -> f64 {
        let elements = ELEMENT_VISITS * self.elements.triangles().len();
        let visits = ROUNDS * (self.springs.len() + elements + self.particle_count());
        let steps = (VISITS / visits.max(1)).clamp(STEPS[0], STEPS[1]);
        let mut eigenvalue =
            |h: f64| largest_eigenvalue(size, steps, |x: &[f64], y: &mut [f64]| apply(h, x, y));
        let mut h = START;
        let mut before: Option<[f64; 2]> = None;
        for round in 1..=ROUNDS {
            let largest = eigenvalue(h);
            if largest <= 0.0 {
                return LONGEST;
            }
            if !largest.is_finite() {
                return 0.0;
            }
            // K and C have no negative eigenvalue: the largest of s h is at most s times that of h for s < 1, and
            // s^2 times for s > 1. A step by that rule ends where all are at most 4.
            let ratio = limit / largest;
            let safe = if ratio < 1.0 { ratio } else { ratio.sqrt() };
            // A power between the two fits better, but may end a little beyond; the last step is a safe one.
            let power = before.map(|[h_before, largest_before]| {
                ((largest / largest_before).ln() / (h / h_before).ln()).clamp(1.0, 2.0)
            });
            before = Some([h, largest]);
            h *= match power {
                Some(power) if round < ROUNDS && power.is_finite() => ratio.powf(power.recip()),
                _ => safe,
            };
            if (safe - 1.0).abs() < 3e-4 || h > LONGEST {
                break;
            }
        }
        h.min(LONGEST)
    }
}

#[cfg(test)]
mod tests;
