//! NUMERICS §3: forces on single particles, given while a simulation runs.

use cloth_core::{Anchor, AnchorSpring, ForceControl, NewtonStart, Real};

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

    /// What the forces add to the system of an implicit substep of `length` \[s\], with anchors moved by `offset` \[m\]: particle, the number on
    /// the diagonal of its block \[kg\], and what its right-hand side has more \[N s\].
    pub(crate) fn terms(
        &self,
        (length, start): (T, NewtonStart),
        offset: [T; 3],
        masses: &Masses<T>,
        motion: &Motion<T>,
    ) -> impl Iterator<Item = (usize, T, [T; 3])> {
        let ahead = if start == NewtonStart::StepStart { length } else { T::ZERO };
        let free = self.forces.iter().filter(|force| !masses.is_held(force.particle));
        free.map(move |force| {
            let position = motion.position.get(force.particle);
            let velocity = motion.velocity.get(force.particle);
            let (d, stiffness) = force.pull(offset, position);
            let diagonal = length * force.damping + (length * length) * stiffness;
            let impulse = std::array::from_fn(|k| {
                let v = velocity[k];
                let pull = stiffness * (d[k] - ahead * v) - force.damping * v;
                length * (force.force[k] + pull)
            });
            (force.particle, diagonal, impulse)
        })
    }

    /// Takes the last kick back.
    pub(crate) fn restore(&self, motion: &mut Motion<T>) {
        for (force, &velocity) in self.forces.iter().zip(&self.before) {
            motion.velocity.set(force.particle, velocity);
        }
    }
}

impl<T: Real> Force<T> {
    /// The way to the anchor, and the stiffness: less beyond the reach, so that the force stays what it is there.
    fn pull(&self, offset: [T; 3], position: [T; 3]) -> ([T; 3], T) {
        let d: [T; 3] = std::array::from_fn(|k| (self.anchor[k] + offset[k]) - position[k]);
        let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let beyond = distance > self.reach;
        (d, if beyond { self.stiffness * (self.reach / distance) } else { self.stiffness })
    }

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
