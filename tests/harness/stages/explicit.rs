//! NUMERICS §4: the order of the stages.

use cloth_core::{
    Colouring, Model, SolverConfig, SpringColouring,
    stepper::{FramePlan, Substep},
};

use super::{
    Particles, aerodynamic_forces, bending_forces, collider_response, contact_forces,
    contact_impulses, field_forces, integrate_explicit, membrane_forces, procedural_forces,
    spring_forces, strain_limit, stretch_limit,
};

/// One substep, all stages in their order.
pub fn explicit_substep(
    model: &Model,
    config: &SolverConfig,
    particles: &mut Particles,
    plan: &FramePlan,
    substep: &Substep,
) {
    let start = particles.positions.clone();
    let mut forces = field_forces(model, particles);
    procedural_forces(model, particles, substep, &mut forces);
    spring_forces(model, particles, &mut forces);
    membrane_forces(model, particles, &mut forces);
    bending_forces(model, particles, &mut forces);
    aerodynamic_forces(model, particles, substep, &mut forces);
    contact_forces(model, particles, &mut forces);
    integrate_explicit(particles, &forces, substep.length);
    contact_impulses(model, particles, substep.length);
    if let Some(limit) = &config.strain_limit {
        let colouring =
            SpringColouring::greedy(model.springs(), model.particle_count(), &limit.classes);
        let triangles =
            Colouring::of_triangles(model.elements().triangles(), model.particle_count());
        for _ in 0..limit.sweeps {
            for colour in 0..colouring.len() {
                let springs = colouring.colour(colour);
                strain_limit(model, particles, springs, limit.ratio, substep.length);
            }
            for colour in 0..triangles.len() {
                let triangles = triangles.colour(colour);
                stretch_limit(model, particles, triangles, limit.ratio, substep.length);
            }
        }
    }
    let colliders = plan.colliders_at(substep.index);
    collider_response(model, particles, colliders, Some((&start, substep.length)));
}
