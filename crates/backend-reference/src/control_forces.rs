//! NUMERICS §3, `control_forces`: forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, ForceControl, Model, NewtonStart, stepper::Substep};

use crate::{LinearSystem, Number, Particles, Vector};

/// The kick of a substep, by forces that were given when all particles were at `given` \[m\].
pub fn control_forces<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    forces: &[ForceControl],
    given: &[[f64; 3]],
    substep: &Substep,
) {
    let h = N::rounded(substep.length);
    let offset = Vector::rounded(substep.anchor_offset);
    for control in forces {
        let i = control.particle as usize;
        if particles.is_held(i) {
            continue;
        }
        let (x, v) = (particles.positions[i], particles.velocities[i]);
        let mut inertia = N::rounded(model.masses()[i]);
        let mut force = Vector::rounded(control.force);
        if let Some(spring) = control.spring {
            let [k, c, reach] = [spring.stiffness, spring.damping, spring.reach].map(N::rounded);
            let anchor = match spring.anchor {
                Anchor::Here => Vector::exact(given[i]),
                Anchor::At(place) => Vector::rounded(place),
            };
            let mut d = (anchor + offset) - x;
            let distance = d.length();
            if distance.value() > spring.reach {
                d = d.scaled(reach / distance);
            }
            inertia = inertia + h * c + h * h * k;
            force += (d - v.scaled(h)).scaled(k) - v.scaled(c);
        }
        particles.velocities[i] += force.scaled(h / inertia);
    }
}

/// What the same forces add to the system of an implicit substep.
pub fn control_forces_assemble<N: Number>(
    particles: &Particles<N>,
    (forces, given): (&[ForceControl], &[[f64; 3]]),
    substep: &Substep,
    start: NewtonStart,
    system: &mut LinearSystem<N>,
) {
    let h = N::rounded(substep.length);
    let offset = Vector::rounded(substep.anchor_offset);
    for control in forces {
        let i = control.particle as usize;
        if particles.is_held(i) {
            continue;
        }
        let (x, v) = (particles.positions[i], particles.velocities[i]);
        let mut force = Vector::rounded(control.force);
        let mut diagonal = N::ZERO;
        if let Some(spring) = control.spring {
            let [mut k, c, reach] =
                [spring.stiffness, spring.damping, spring.reach].map(N::rounded);
            let anchor = match spring.anchor {
                Anchor::Here => Vector::exact(given[i]),
                Anchor::At(place) => Vector::rounded(place),
            };
            let d = (anchor + offset) - x;
            let distance = d.length();
            if distance.value() > spring.reach {
                k = k * (reach / distance);
            }
            force += d.scaled(k) - v.scaled(c);
            if start == NewtonStart::StepStart {
                force -= v.scaled(h * k);
            }
            diagonal = h * c + h * h * k;
        }
        system.add(i, diagonal, force.scaled(h));
    }
}
