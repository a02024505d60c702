//! NUMERICS §3: forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, AnchorSpring, ForceControl, Real};

use crate::memory::{Masses, Motion};

/// The forces in effect.
#[derive(Clone, Debug, Default)]
pub(crate) struct ControlForces<T> {
    forces: Vec<Force<T>>,
    /// Velocities before the last kick; empty if there was none.
    before: Vec<[T; 3]>,
}

#[derive(Clone, Copy, Debug)]
struct Force<T> {
    particle: usize,
    force: [T; 3],
    anchor: [T; 3],
    stiffness: T,
    damping: T,
    reach: T,
}

impl<T: Real> ControlForces<T> {
    /// `forces` on particles that are where `motion` has them.
    pub(crate) fn new(forces: &[ForceControl], motion: &Motion<T>) -> Self {
        let forces = forces.iter().map(|control| {
            let particle = control.particle as usize;
            let none =
                AnchorSpring { anchor: Anchor::Here, stiffness: 0.0, damping: 0.0, reach: 0.0 };
            let spring = control.spring.unwrap_or(none);
            Force {
                particle,
                force: control.force.map(T::from_f64),
                anchor: match spring.anchor {
                    Anchor::Here => motion.position.get(particle),
                    Anchor::At(place) => place.map(T::from_f64),
                },
                stiffness: T::from_f64(spring.stiffness),
                damping: T::from_f64(spring.damping),
                reach: T::from_f64(spring.reach),
            }
        });
        Self { forces: forces.collect(), before: Vec::new() }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.forces.is_empty()
    }

    /// The kick at the start of a substep of `length` \[s\], with anchors moved by `offset` \[m\].
    pub(crate) fn kick(
        &mut self,
        length: T,
        offset: [T; 3],
        masses: &Masses<T>,
        motion: &mut Motion<T>,
    ) {
        self.before.clear();
        for force in &self.forces {
            let velocity = motion.velocity.get(force.particle);
            self.before.push(velocity);
            if !masses.is_held(force.particle) {
                let position = motion.position.get(force.particle);
                let mass = masses.mass[force.particle];
                let kicked = force.kicked(length, offset, mass, (position, velocity));
                motion.velocity.set(force.particle, kicked);
            }
        }
    }

    /// Takes the last kick back.
    pub(crate) fn restore(&self, motion: &mut Motion<T>) {
        for (force, &velocity) in self.forces.iter().zip(&self.before) {
            motion.velocity.set(force.particle, velocity);
        }
    }
}

impl<T: Real> Force<T> {
    fn kicked(
        &self,
        length: T,
        offset: [T; 3],
        mass: T,
        (position, velocity): ([T; 3], [T; 3]),
    ) -> [T; 3] {
        let Self { stiffness, damping, reach, .. } = *self;
        let mut d: [T; 3] = std::array::from_fn(|k| (self.anchor[k] + offset[k]) - position[k]);
        let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if distance > reach {
            let share = reach / distance;
            d = d.map(|component| component * share);
        }
        let inertia = (mass + length * damping) + (length * length) * stiffness;
        let factor = length / inertia;
        std::array::from_fn(|k| {
            let v = velocity[k];
            let pull = stiffness * (d[k] - length * v) - damping * v;
            v + factor * (self.force[k] + pull)
        })
    }
}
