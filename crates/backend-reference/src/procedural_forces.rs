//! NUMERICS §3, `procedural_forces`: force fields given as expressions.

use cloth_core::{Model, stepper::Substep};

use crate::{Particles, Vector};

/// Adds the force of each field, fields in their order.
pub fn procedural_forces(
    model: &Model,
    particles: &Particles<f64>,
    substep: &Substep,
    forces: &mut [Vector<f64>],
) {
    for program in model.field_programs() {
        for (i, force) in forces.iter_mut().enumerate() {
            let (x, v) = (particles.positions[i].0, particles.velocities[i].0);
            let (mass, time) = (model.masses()[i], substep.time);
            *force += Vector(program.evaluate(x, v, time, mass, i, substep.length));
        }
    }
}
