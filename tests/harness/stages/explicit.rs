//! NUMERICS §4: symplectic Euler, strain limiting, and the order of the stages.

use cloth_core::{
    Model, SolverConfig, SpringColouring,
    stepper::{FramePlan, Substep},
};

use super::{
    LENGTH_MIN, Particles, ZERO, aerodynamic_forces, collider_response, contact_forces,
    contact_impulses, field_forces, procedural_forces, spring_forces,
};
use crate::tracked::{Tracked, TrackedVector};

/// v += h w f, then x += h v.
pub fn integrate_explicit(particles: &mut Particles, forces: &[TrackedVector], time_step: f64) {
    let time_step = Tracked::rounded(time_step);
    for (i, force) in forces.iter().enumerate() {
        let inverse_mass = particles.inverse_masses[i];
        particles.velocities[i] += force.scaled(inverse_mass).scaled(time_step);
        let velocity = particles.velocities[i];
        particles.positions[i] += velocity.scaled(time_step);
    }
}

/// Shortens the springs of one colour that are longer than `ratio` L.
pub fn strain_limit(
    model: &Model,
    particles: &mut Particles,
    springs: &[[u32; 3]],
    ratio: f64,
    time_step: f64,
    epsilon: f64,
) {
    let [ratio, time_step] = [ratio, time_step].map(Tracked::rounded);
    for &[i, j, kind] in springs {
        let [i, j] = [i, j].map(|particle| particle as usize);
        let rest_length = Tracked::rounded(model.springs().kinds()[kind as usize].rest_length);
        let difference = particles.positions[j] - particles.positions[i];
        let length = difference.length();
        let excess = length - ratio * rest_length;
        let [w_i, w_j] = [particles.inverse_masses[i], particles.inverse_masses[j]];
        let untouched = excess.value <= 0.0 && !excess.is_close(ZERO, epsilon);
        if untouched || w_i.value + w_j.value == 0.0 {
            continue;
        }
        let normal = difference.divided(length.max(LENGTH_MIN));
        let step = normal.scaled(excess.max(ZERO) / (w_i + w_j));
        particles.positions[i] += step.scaled(w_i);
        particles.velocities[i] += step.scaled(w_i).divided(time_step);
        particles.positions[j] -= step.scaled(w_j);
        particles.velocities[j] -= step.scaled(w_j).divided(time_step);
    }
}

/// One substep, all stages in their order.
pub fn explicit_substep(
    model: &Model,
    config: &SolverConfig,
    particles: &mut Particles,
    plan: &FramePlan,
    substep: &Substep,
    epsilon: f64,
) {
    let start = particles.positions.clone();
    let mut forces = field_forces(model, particles);
    procedural_forces(model, particles, substep, &mut forces);
    spring_forces(model, particles, &mut forces, epsilon);
    aerodynamic_forces(model, particles, substep.wind_velocity, &mut forces);
    contact_forces(model, particles, &mut forces, epsilon);
    integrate_explicit(particles, &forces, substep.length);
    contact_impulses(model, particles, substep.length, epsilon);
    if let Some(limit) = &config.strain_limit {
        let colouring =
            SpringColouring::greedy(model.springs(), model.particle_count(), &limit.classes);
        for _ in 0..limit.sweeps {
            for colour in 0..colouring.len() {
                let springs = colouring.colour(colour);
                strain_limit(model, particles, springs, limit.ratio, substep.length, epsilon);
            }
        }
    }
    let colliders = plan.colliders_at(substep.index);
    collider_response(model, particles, colliders, Some((&start, substep.length)), epsilon);
}
