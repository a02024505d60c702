//! NUMERICS §3: gravity, uniform fields, drag.

use cloth_core::{Field, Model};

use super::Particles;
use crate::tracked::{Tracked, TrackedVector};

/// f = m (a - r v).
#[must_use]
pub fn field_forces(model: &Model, particles: &Particles) -> Vec<TrackedVector> {
    let mut acceleration = TrackedVector::rounded(model.gravity());
    let mut rate = TrackedVector::ZERO;
    for field in model.fields() {
        match field {
            Field::Uniform { acceleration: more } => acceleration += TrackedVector::rounded(*more),
            Field::Drag { rate: more } => rate += TrackedVector::rounded(*more),
            // A stage of their own.
            Field::Procedural { .. } => {}
        }
    }
    let masses = model.masses().iter().map(|&mass| Tracked::rounded(mass));
    let force = |(mass, velocity): (Tracked, &TrackedVector)| {
        (acceleration - rate.each(*velocity, |r, v| r * v)).scaled(mass)
    };
    masses.zip(&particles.velocities).map(force).collect()
}
