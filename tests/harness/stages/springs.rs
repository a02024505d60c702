//! NUMERICS §2: springs with dampers.

use cloth_core::{Model, Spring};

use super::{LENGTH_MIN, Particles};
use crate::tracked::{Tracked, TrackedVector};

/// The force of a spring on the first of its particles; the other one feels the opposite.
#[must_use]
pub fn spring_force_on(model: &Model, particles: &Particles, spring: &Spring) -> TrackedVector {
    let kind = model.springs().kinds()[spring.kind as usize];
    let [stiffness, damping, rest_length] =
        [kind.stiffness, kind.damping, kind.rest_length].map(Tracked::rounded);
    let [i, j] = spring.particles.map(|particle| particle as usize);
    let difference = particles.positions[j] - particles.positions[i];
    let length = difference.length();
    let normal = difference.divided(length.max(LENGTH_MIN));
    let approach = (particles.velocities[j] - particles.velocities[i]).dot(normal);
    normal.scaled(stiffness * (length - rest_length) + damping * approach)
}

/// Adds the force of every spring to both its particles.
pub fn spring_forces(model: &Model, particles: &Particles, forces: &mut [TrackedVector]) {
    for spring in model.springs().iter() {
        let force = spring_force_on(model, particles, &spring);
        forces[spring.particles[0] as usize] += force;
        forces[spring.particles[1] as usize] -= force;
    }
}
