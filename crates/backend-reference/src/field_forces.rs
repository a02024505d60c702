//! NUMERICS §3, `field_forces`: gravity, uniform fields, drag.

use cloth_core::{Field, Model};

use crate::{Number, Particles, Vector};

/// Sets f = m (a - r v).
#[must_use]
pub fn field_forces<N: Number>(model: &Model, particles: &Particles<N>) -> Vec<Vector<N>> {
    let (acceleration, rate) = field_sums(model);
    let masses = model.masses().iter().map(|&mass| N::rounded(mass));
    let force = |(mass, velocity): (N, &Vector<N>)| {
        (acceleration - rate.each(*velocity, |r, v| r * v)).scaled(mass)
    };
    masses.zip(&particles.velocities).map(force).collect()
}

/// The sum a of gravity and the uniform fields, and the sum r of the drag rates.
pub(crate) fn field_sums<N: Number>(model: &Model) -> (Vector<N>, Vector<N>) {
    let mut acceleration = Vector::rounded(model.gravity());
    let mut rate = Vector::ZERO;
    for field in model.fields() {
        match field {
            Field::Uniform { acceleration: more } => acceleration += Vector::rounded(*more),
            Field::Drag { rate: more } => rate += Vector::rounded(*more),
            // A stage of their own.
            Field::Procedural { .. } => {}
        }
    }
    (acceleration, rate)
}
