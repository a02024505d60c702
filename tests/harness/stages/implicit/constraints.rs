//! NUMERICS §5: `collider_constraints`, `constraint_release`, `constraint_impulses`, and what friction adds to the
//! system.

use cloth_core::{Field, Model, stepper::ColliderState};

use super::{
    super::{ONE, Particles, TrackedImpulse, colliders},
    LinearSystem, TrackedMatrix,
    touch::{Outcome, Solved, Touch},
};
use crate::tracked::{Tracked, TrackedVector};

/// Contacts that count for a particle.
const TOUCHES_MAX: usize = 4;

/// The constraint of one particle; without contacts it is free.
#[derive(Clone, Debug, Default)]
pub struct Constraint {
    touches: Vec<Touch>,
    directions: Vec<TrackedVector>,
    target: TrackedVector,
    held: bool,
}

/// The constraints of all particles.
#[derive(Clone, Debug)]
pub struct Constraints(pub Vec<Constraint>);

impl Constraint {
    /// S.
    #[must_use]
    pub fn filter(&self) -> TrackedMatrix {
        if self.held || self.directions.len() == 3 {
            return TrackedMatrix::ZERO;
        }
        let mut filter = TrackedMatrix::diagonal(ONE);
        for &direction in &self.directions {
            filter += TrackedMatrix::outer(direction, direction).negated();
        }
        filter
    }

    /// Whether nothing constrains the particle.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.touches.is_empty() && !self.held
    }

    /// Whether it is held, which is not for colliders to say.
    #[must_use]
    pub const fn is_held(&self) -> bool {
        self.held
    }

    /// z, for a particle with this velocity.
    #[must_use]
    pub fn change(&self, velocity: TrackedVector) -> TrackedVector {
        if self.is_free() || self.held {
            return TrackedVector::ZERO;
        }
        let change = self.target - velocity;
        change - self.filter().apply(change)
    }

    /// Filter and target from the contacts. Returns whether rounding decides about a direction.
    fn update(&mut self, epsilon: f64) -> bool {
        self.directions.clear();
        self.target = TrackedVector::ZERO;
        let mut uncertain = false;
        for touch in self.touches.clone() {
            uncertain |= self.constrain(touch.normal, touch.speed, epsilon);
            if touch.sticks {
                let extra = touch.speed - touch.surface.dot(touch.normal);
                let velocity = touch.surface + touch.normal.scaled(extra);
                for axis in 0..3 {
                    let unit = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
                    let direction = TrackedVector::exact(unit);
                    uncertain |= self.constrain(direction, velocity.0[axis], epsilon);
                }
            }
        }
        uncertain
    }

    /// What a solve makes of the contacts: whether anything changed, and whether rounding decides.
    fn release(&mut self, solved: &Solved, epsilon: f64) -> (bool, bool) {
        let [mut changed, mut uncertain] = [false; 2];
        for index in (0..self.touches.len()).rev() {
            let touch = &mut self.touches[index];
            let (outcome, close) = touch.outcome(solved, epsilon);
            uncertain |= close;
            match outcome {
                Outcome::Stands => continue,
                Outcome::Corrected(drag) => {
                    touch.drag = drag;
                    changed = true;
                    continue;
                }
                Outcome::Slips(drag) => {
                    touch.sticks = false;
                    touch.drag = drag;
                }
                Outcome::Pulls => {
                    self.touches.remove(index);
                }
            }
            uncertain |= self.update(epsilon);
            return (true, uncertain);
        }
        (changed, uncertain)
    }

    /// What each of its contacts does, from A y - b and the velocity at the end: the number of the
    /// collider and the impulse.
    fn impulses(
        &self,
        excess: TrackedVector,
        velocity: TrackedVector,
        epsilon: f64,
    ) -> Vec<(usize, TrackedVector)> {
        // How many directions there are with the first contacts alone.
        let mut counts = vec![0];
        let mut first = Self::default();
        for &touch in &self.touches {
            first.touches.push(touch);
            first.update(epsilon);
            counts.push(first.directions.len());
        }
        let mut rest = excess;
        let mut impulses = Vec::new();
        for (index, touch) in self.touches.iter().enumerate().rev() {
            let own = &self.directions[counts[index]..counts[index + 1]];
            let share = if index == 0 { rest } else { touch.share(own, rest) };
            rest -= share;
            impulses.push((touch.collider, share + touch.friction_impulse(velocity)));
        }
        impulses
    }

    /// Adds the drag of its contacts, times `sign`, to the system.
    fn add_drags(
        &self,
        particle: usize,
        velocity: TrackedVector,
        sign: f64,
        system: &mut LinearSystem,
    ) {
        for touch in &self.touches {
            if touch.drag != Tracked::default() {
                let drag = touch.drag * Tracked::exact(sign);
                system.add_drag(particle, drag, touch.normal, velocity - touch.surface);
            }
        }
    }

    fn constrain(&mut self, direction: TrackedVector, speed: Tracked, epsilon: f64) -> bool {
        if self.directions.len() == 3 {
            return false;
        }
        let mut rest = direction;
        for &taken in &self.directions {
            rest -= taken.scaled(taken.dot(direction));
        }
        let [length, smallest] = [rest.length(), Tracked::rounded(1e-3)];
        if length.value >= smallest.value {
            let unit = rest.divided(length);
            let missing = (speed - direction.dot(self.target)) / length;
            self.target += unit.scaled(missing);
            self.directions.push(unit);
        }
        length.is_close(smallest, epsilon)
    }
}

impl Constraints {
    /// `collider_constraints`.
    #[must_use]
    pub fn new(
        model: &Model,
        particles: &mut Particles,
        states: &[ColliderState],
        length: f64,
        epsilon: f64,
    ) -> Self {
        let h = Tracked::rounded(length);
        let (acceleration, rate) = fields(model);
        let mut all = vec![Constraint::default(); particles.len()];
        for (i, constraint) in all.iter_mut().enumerate() {
            constraint.held = particles.inverse_masses[i].value == 0.0;
            if constraint.held {
                continue;
            }
            let [x, v] = [particles.positions[i], particles.velocities[i]];
            let predicted = v + (acceleration - rate.each(v, |r, v| r * v)).scaled(h);
            for (number, (collider, state)) in model.colliders().iter().zip(states).enumerate() {
                let surface = colliders::surface_at(&collider.shape, state, x, epsilon);
                let normal = surface.normal;
                let gap = surface.distance - colliders::half_thickness(model, i);
                let [approach, largest] = [normal.dot(predicted), -gap / h];
                let inside = approach.value < largest.value;
                let mut uncertain = approach.is_close(largest, epsilon);
                if inside || uncertain {
                    uncertain |= surface.uncertain;
                }
                if inside && constraint.touches.len() < TOUCHES_MAX {
                    let carried = colliders::carried(state, x) + normal.scaled(surface.speed);
                    let coefficients =
                        [collider.restitution, collider.friction].map(Tracked::rounded);
                    let mass = Tracked::rounded(model.masses()[i]);
                    let velocities = [v, predicted, carried];
                    let at = (number, normal, largest);
                    let (touch, close) = Touch::new(at, mass, velocities, coefficients, epsilon);
                    constraint.touches.push(touch);
                    uncertain |= close | constraint.update(epsilon);
                }
                particles.uncertain[i] |= uncertain;
            }
        }
        Self(all)
    }

    /// The part of `implicit_assemble` that is friction, for particles with these velocities.
    pub fn add_drags(&self, velocities: &[TrackedVector], system: &mut LinearSystem) {
        for (i, (constraint, &velocity)) in self.0.iter().zip(velocities).enumerate() {
            constraint.add_drags(i, velocity, 1.0, system);
        }
    }

    /// `constraint_release`, given a solution of the system. Returns the number of particles whose
    /// contacts changed.
    pub fn release(
        &mut self,
        model: &Model,
        particles: &mut Particles,
        system: &mut LinearSystem,
        solution: &[TrackedVector],
        epsilon: f64,
    ) -> u64 {
        let (image, blocks) = (system.apply(solution), system.blocks());
        let mut released = 0;
        for (i, constraint) in self.0.iter_mut().enumerate() {
            let velocity = particles.velocities[i];
            let solved = Solved {
                impulse: image[i] - system.right_side[i],
                velocity: velocity + solution[i],
                mass: Tracked::rounded(model.masses()[i]),
                inertia: blocks[&[i, i]],
            };
            let before = constraint.clone();
            let (changed, uncertain) = constraint.release(&solved, epsilon);
            particles.uncertain[i] |= uncertain;
            if changed {
                before.add_drags(i, velocity, -1.0, system);
                constraint.add_drags(i, velocity, 1.0, system);
                released += 1;
            }
        }
        released
    }
}

/// What the constraints did to particles with the velocities of the end of a substep: the sums of each of
/// `count` colliders. Without a solution it is zero.
#[must_use]
pub fn constraint_impulses(
    constraints: &Constraints,
    particles: &Particles,
    (system, solution): (&LinearSystem, Option<&[TrackedVector]>),
    count: usize,
    epsilon: f64,
) -> Vec<TrackedImpulse> {
    let mut sums = vec![[TrackedVector::ZERO; 2]; count];
    let image = solution.map(|solution| system.apply(solution));
    for (i, constraint) in constraints.0.iter().enumerate() {
        let image = image.as_ref().map_or(TrackedVector::ZERO, |image| image[i]);
        let (excess, velocity) = (image - system.right_side[i], particles.velocities[i]);
        for (collider, impulse) in constraint.impulses(excess, velocity, epsilon) {
            sums[collider][0] += impulse;
            sums[collider][1] += particles.positions[i].cross(impulse);
        }
    }
    sums
}

/// Sum of accelerations and of drag rates.
fn fields(model: &Model) -> (TrackedVector, TrackedVector) {
    let mut acceleration = TrackedVector::rounded(model.gravity());
    let mut rate = TrackedVector::ZERO;
    for field in model.fields() {
        match field {
            Field::Uniform { acceleration: more } => acceleration += TrackedVector::rounded(*more),
            Field::Drag { rate: more } => rate += TrackedVector::rounded(*more),
            Field::Procedural { .. } => {}
        }
    }
    (acceleration, rate)
}
