//! NUMERICS §5: `collider_constraints`, `constraint_release`, `constraint_friction`.

use cloth_core::{Field, Model, stepper::ColliderState};

use super::{
    super::{LENGTH_MIN, ONE, Particles, ZERO, colliders},
    TrackedMatrix,
};
use crate::tracked::{Tracked, TrackedVector};

/// Contacts that count for a particle.
const TOUCHES_MAX: usize = 4;

/// Contact with one collider.
#[derive(Clone, Copy, Debug)]
struct Touch {
    normal: TrackedVector,
    /// Velocity along the normal that is asked for.
    speed: Tracked,
    /// Velocity of the collider.
    surface: TrackedVector,
    friction: Tracked,
    sticks: bool,
}

/// The constraint of one particle; without contacts it is free.
#[derive(Clone, Debug, Default)]
pub struct Constraint {
    touches: Vec<Touch>,
    directions: Vec<TrackedVector>,
    target: TrackedVector,
    impulse: TrackedVector,
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
            for (collider, state) in model.colliders().iter().zip(states) {
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
                    let carried = colliders::carried(state, x);
                    let coefficients =
                        [collider.restitution, collider.friction].map(Tracked::rounded);
                    let (touch, close) =
                        touch(normal, largest, [v, predicted, carried], coefficients, epsilon);
                    constraint.touches.push(touch);
                    uncertain |= close | constraint.update(epsilon);
                }
                particles.uncertain[i] |= uncertain;
            }
        }
        Self(all)
    }

    /// `constraint_release`, given A y - b. Returns the number of contacts that changed.
    pub fn release(
        &mut self,
        particles: &mut Particles,
        impulses: &[TrackedVector],
        epsilon: f64,
    ) -> u64 {
        let mut released = 0;
        for (i, constraint) in self.0.iter_mut().enumerate() {
            constraint.impulse = impulses[i];
            for index in (0..constraint.touches.len()).rev() {
                let touch = constraint.touches[index];
                let push = impulses[i].dot(touch.normal);
                let slip = (impulses[i] - touch.normal.scaled(push)).length();
                let holds = touch.friction * push;
                particles.uncertain[i] |= push.is_close(ZERO, epsilon);
                if push.value < 0.0 {
                    constraint.touches.remove(index);
                } else if touch.sticks && slip.value > holds.value {
                    particles.uncertain[i] |= slip.is_close(holds, epsilon);
                    constraint.touches[index].sticks = false;
                } else {
                    particles.uncertain[i] |= touch.sticks && slip.is_close(holds, epsilon);
                    continue;
                }
                particles.uncertain[i] |= constraint.update(epsilon);
                released += 1;
                break;
            }
        }
        released
    }

    /// `constraint_friction`, on the velocities.
    pub fn friction(&self, particles: &mut Particles) {
        for (i, constraint) in self.0.iter().enumerate() {
            for touch in constraint.touches.iter().filter(|touch| !touch.sticks) {
                let push = constraint.impulse.dot(touch.normal).max(ZERO);
                let relative = particles.velocities[i] - touch.surface;
                let slip = relative - touch.normal.scaled(relative.dot(touch.normal));
                let speed = slip.length();
                let lost = (touch.friction * push * particles.inverse_masses[i]).min(speed);
                particles.velocities[i] -= slip.scaled(lost / speed.max(LENGTH_MIN));
            }
        }
    }
}

/// The contact of a particle, and whether rounding decides what it is like.
fn touch(
    normal: TrackedVector,
    largest: Tracked,
    [velocity, predicted, surface]: [TrackedVector; 3],
    [restitution, friction]: [Tracked; 2],
    epsilon: f64,
) -> (Touch, bool) {
    let carried = surface.dot(normal);
    let approach = (velocity - surface).dot(normal);
    let mut speed = largest.min(carried);
    let mut uncertain = false;
    if restitution.value > 0.0 {
        uncertain = approach.is_close(ZERO, epsilon);
        if approach.value < 0.0 {
            speed = speed.max(carried - restitution * approach);
        }
    }
    let relative = predicted - surface;
    let slip = (relative - normal.scaled(relative.dot(normal))).length();
    let holds = friction * (speed - predicted.dot(normal));
    uncertain |= slip.is_close(holds, epsilon);
    let sticks = slip.value <= holds.value;
    (Touch { normal, speed, surface, friction, sticks }, uncertain)
}

/// Sum of accelerations and of drag rates.
fn fields(model: &Model) -> (TrackedVector, TrackedVector) {
    let mut acceleration = TrackedVector::rounded(model.gravity());
    let mut rate = TrackedVector::ZERO;
    for field in model.fields() {
        match *field {
            Field::Uniform { acceleration: more } => acceleration += TrackedVector::rounded(more),
            Field::Drag { rate: more } => rate += TrackedVector::rounded(more),
        }
    }
    (acceleration, rate)
}
