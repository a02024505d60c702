//! NUMERICS §2, `spring_forces`: springs with dampers.

use cloth_core::{Model, Spring};

use crate::{Number, Particles, Vector, buckling::spring_tension, particles::length_min};

/// The force of a spring on the first of its particles; the other one feels the opposite.
#[must_use]
pub fn spring_force_on<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    spring: &Spring,
) -> Vector<N> {
    let kind = model.springs().kinds()[spring.kind as usize];
    let [i, j] = spring.particles.map(|particle| particle as usize);
    let difference = particles.positions[j] - particles.positions[i];
    let length = difference.length();
    let normal = difference.divided(length.max(length_min()));
    let approach = (particles.velocities[j] - particles.velocities[i]).dot(normal);
    let tension = spring_tension(&kind, length, particles.epsilon);
    normal.scaled(tension + N::rounded(kind.damping) * approach)
}

/// Adds the force of every spring to both its particles. Springs ascend, so that the sum of each particle does, too.
pub fn spring_forces<N: Number>(model: &Model, particles: &Particles<N>, forces: &mut [Vector<N>]) {
    for spring in model.springs().iter() {
        let force = spring_force_on(model, particles, &spring);
        forces[spring.particles[0] as usize] += force;
        forces[spring.particles[1] as usize] -= force;
    }
}
