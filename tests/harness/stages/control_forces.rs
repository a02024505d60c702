//! NUMERICS §3: forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, ForceControl, Model, stepper::Substep};

use super::Particles;
use crate::tracked::{Tracked, TrackedVector};

/// The kick of a substep, by forces that were given when all particles were at `given` \[m\].
pub fn control_forces(
    model: &Model,
    particles: &mut Particles,
    forces: &[ForceControl],
    given: &[[f64; 3]],
    substep: &Substep,
) {
    let h = Tracked::rounded(substep.length);
    let offset = TrackedVector::rounded(substep.anchor_offset);
    for control in forces {
        let i = control.particle as usize;
        if particles.inverse_masses[i].value == 0.0 {
            continue;
        }
        let (x, v) = (particles.positions[i], particles.velocities[i]);
        let mut inertia = Tracked::rounded(model.masses()[i]);
        let mut force = TrackedVector::rounded(control.force);
        if let Some(spring) = control.spring {
            let [k, c, reach] =
                [spring.stiffness, spring.damping, spring.reach].map(Tracked::rounded);
            let anchor = match spring.anchor {
                Anchor::Here => TrackedVector::exact(given[i]),
                Anchor::At(place) => TrackedVector::rounded(place),
            };
            let mut d = (anchor + offset) - x;
            let distance = d.length();
            if distance.value > spring.reach {
                d = d.scaled(reach / distance);
            }
            inertia = inertia + h * c + h * h * k;
            force += (d - v.scaled(h)).scaled(k) - v.scaled(c);
        }
        particles.velocities[i] += force.scaled(h / inertia);
    }
}
