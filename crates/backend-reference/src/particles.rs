//! The state of all particles.

use cloth_core::{Model, State};

use crate::{Number, Vector};

/// Positions, velocities and inverse masses.
#[derive(Clone, Debug)]
pub struct Particles<N> {
    /// Positions \[m\].
    pub positions: Vec<Vector<N>>,
    /// Velocities \[m/s\].
    pub velocities: Vec<Vector<N>>,
    /// 1/m \[1/kg\], 0 while held.
    pub inverse_masses: Vec<N>,
    /// Distance between 1 and the next larger number, of the backend whose rounding is in question.
    pub epsilon: f64,
    /// Whether rounding decided what happened to the particle: both answers are right.
    pub uncertain: Vec<bool>,
}

impl<N: Number> Particles<N> {
    /// The particles of a state that a backend with this `epsilon` holds exactly.
    #[must_use]
    pub fn new(model: &Model, state: &State, epsilon: f64) -> Self {
        let inverse_masses = model.masses().iter().zip(&state.held);
        let inverse_mass = |(mass, &held): (&f64, &u8)| {
            if held == 0 { N::rounded(mass.recip()) } else { N::ZERO }
        };
        Self {
            positions: state.positions.iter().copied().map(Vector::exact).collect(),
            velocities: state.velocities.iter().copied().map(Vector::exact).collect(),
            inverse_masses: inverse_masses.map(inverse_mass).collect(),
            epsilon,
            uncertain: vec![false; state.len()],
        }
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Whether a particle is held.
    #[must_use]
    pub fn is_held(&self, particle: usize) -> bool {
        self.inverse_masses[particle].value() == 0.0
    }

    /// Notes for each of `particles` that rounding decides, if it can tell which of two numbers is smaller.
    pub fn doubt<const COUNT: usize>(&mut self, particles: [usize; COUNT], a: N, b: N) {
        if a.is_close(b, self.epsilon) {
            particles.iter().for_each(|&particle| self.uncertain[particle] = true);
        }
    }
}

/// Lengths below this count as this in a division.
pub(crate) fn length_min<N: Number>() -> N {
    N::rounded(1e-18)
}
