//! Every stage of NUMERICS.md as plain loops, one file per section.
//!
//! Written from the text, without looking at any backend: no neighbour lists, no fusing, every pair
//! of particles tried. Only the constants of the model come from `cloth-core`.

mod aerodynamics;
mod colliders;
mod contact;
mod control_forces;
mod explicit;
mod fields;
mod implicit;
mod measure;
mod normals;
mod procedural;
mod semi_implicit;
mod springs;

use cloth_core::{Model, State};

use crate::tracked::{Tracked, TrackedVector};

pub use aerodynamics::aerodynamic_forces;
pub use colliders::{PathStart, TrackedImpulse, collider_response, penetration_max};
pub use contact::{
    ContactPairs, contact_forces, contact_forces_of, contact_impulses, contact_impulses_of,
    contact_pairs,
};
pub use control_forces::control_forces;
pub use explicit::{explicit_substep, integrate_explicit, strain_limit};
pub use fields::field_forces;
pub use implicit::{
    Constraint, Constraints, LinearSystem, Term, TrackedMatrix, air_jacobians, constraint_impulses,
    contact_terms, preconditioner_apply, spring_terms,
};
pub use measure::{TrackedMeasures, measure};
pub use normals::vertex_normals;
pub use procedural::{PROCEDURAL_COUNT, procedural_forces, procedural_source};
pub use semi_implicit::{Surplus, angular_surplus, pieces, semi_implicit_residual};
pub use springs::{
    spring_energy_doubled, spring_force_on, spring_forces, spring_tension,
    spring_tension_derivative,
};

/// The state of all particles.
#[derive(Clone, Debug)]
pub struct Particles {
    /// Positions \[m\].
    pub positions: Vec<TrackedVector>,
    /// Velocities \[m/s\].
    pub velocities: Vec<TrackedVector>,
    /// 1/m \[1/kg\], 0 while held.
    pub inverse_masses: Vec<Tracked>,
    /// Whether rounding decided what happened to the particle: both answers are right.
    pub uncertain: Vec<bool>,
}

impl Particles {
    /// The particles of a state that every backend holds exactly.
    #[must_use]
    pub fn new(model: &Model, state: &State) -> Self {
        let inverse_masses = model.masses().iter().zip(&state.held).map(|(mass, &held)| {
            if held == 0 { Tracked::rounded(mass.recip()) } else { Tracked::exact(0.0) }
        });
        Self {
            positions: state.positions.iter().copied().map(TrackedVector::exact).collect(),
            velocities: state.velocities.iter().copied().map(TrackedVector::exact).collect(),
            inverse_masses: inverse_masses.collect(),
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
}

/// Lengths below this count as this in a division.
const LENGTH_MIN: Tracked = Tracked::rounded(1e-18);

const ZERO: Tracked = Tracked::exact(0.0);
const ONE: Tracked = Tracked::exact(1.0);
