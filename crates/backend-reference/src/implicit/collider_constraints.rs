//! NUMERICS §5, `collider_constraints`, `constraint_filter` and `constraint_project`.

use cloth_core::{Model, stepper::ColliderState};

use super::{LinearSystem, touch::Touch};
use crate::{
    Matrix, Number, Particles, Vector,
    field_forces::field_sums,
    surface::{half_thickness, surface_at, velocity_at},
};

/// Contacts that count for a particle.
const TOUCHES_MAX: usize = 4;

/// A normal that has less than this outside of the directions constrained already adds nothing.
const DIRECTION_MIN: f64 = 1e-3;

/// The constraint of one particle; without contacts it is free.
#[derive(Clone, Debug, Default)]
pub struct Constraint<N> {
    pub(super) touches: Vec<Touch<N>>,
    pub(super) directions: Vec<Vector<N>>,
    target: Vector<N>,
    held: bool,
}

/// The constraints of all particles.
#[derive(Clone, Debug, Default)]
pub struct Constraints<N>(pub Vec<Constraint<N>>);

/// The constraints that colliders put on velocities in a substep of `length` \[s\].
#[must_use]
pub fn collider_constraints<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    states: &[ColliderState],
    length: f64,
) -> Constraints<N> {
    let (h, epsilon) = (N::rounded(length), particles.epsilon);
    let (acceleration, rate) = field_sums::<N>(model);
    let mut constraints = Constraints::of_pins(particles);
    for (i, constraint) in constraints.0.iter_mut().enumerate().filter(|(_, c)| !c.held) {
        let (x, v) = (particles.positions[i], particles.velocities[i]);
        let predicted = v + (acceleration - rate.each(v, |r, v| r * v)).scaled(h);
        let both = model.colliders().iter().zip(states).enumerate();
        for (number, (collider, state)) in
            both.filter(|&(number, _)| !model.is_contact_body(number))
        {
            let surface = surface_at(&collider.shape, state, x, epsilon);
            let normal = surface.normal;
            let gap = surface.distance - half_thickness(model, i);
            let [approach, largest] = [normal.dot(predicted), -gap / h];
            let inside = approach.value() < largest.value();
            let mut uncertain = approach.is_close(largest, epsilon);
            if inside || uncertain {
                uncertain |= surface.uncertain;
            }
            if inside && constraint.touches.len() < TOUCHES_MAX {
                let carried = velocity_at(state, x) + normal.scaled(surface.speed);
                let coefficients = [collider.restitution, collider.friction].map(N::rounded);
                let mass = N::rounded(model.masses()[i]);
                let velocities = [v, predicted, carried];
                let at = (number, normal, largest);
                let (touch, close) = Touch::new(at, mass, velocities, coefficients, epsilon);
                constraint.touches.push(touch);
                uncertain |= close | constraint.update(epsilon);
            }
            particles.uncertain[i] |= uncertain;
        }
    }
    constraints
}

impl<N: Number> Constraint<N> {
    /// S.
    #[must_use]
    pub fn filter(&self) -> Matrix<N> {
        if self.held || self.directions.len() == 3 {
            return Matrix::ZERO;
        }
        let mut filter = Matrix::diagonal(N::ONE);
        for &direction in &self.directions {
            filter += Matrix::outer(direction, direction).negated();
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

    /// `constraint_filter`: S y.
    #[must_use]
    pub fn filtered(&self, y: Vector<N>) -> Vector<N> {
        if self.is_free() { y } else { self.filter().apply(y) }
    }

    /// z, for a particle with this velocity.
    #[must_use]
    pub fn change(&self, velocity: Vector<N>) -> Vector<N> {
        if self.is_free() || self.held {
            return Vector::ZERO;
        }
        let change = self.target - velocity;
        change - self.filter().apply(change)
    }

    /// Filter and target from the contacts. Returns whether rounding decides about a direction.
    pub(super) fn update(&mut self, epsilon: f64) -> bool {
        self.directions.clear();
        self.target = Vector::ZERO;
        let mut uncertain = false;
        for touch in self.touches.clone() {
            uncertain |= self.constrain(touch.normal, touch.speed, epsilon);
            if touch.sticks {
                let extra = touch.speed - touch.surface.dot(touch.normal);
                let velocity = touch.surface + touch.normal.scaled(extra);
                for axis in 0..3 {
                    uncertain |= self.constrain(Vector::axis(axis), velocity.0[axis], epsilon);
                }
            }
        }
        uncertain
    }

    /// Constrains the velocity along a direction, as far as it is free. Returns whether rounding decides that it is.
    fn constrain(&mut self, direction: Vector<N>, speed: N, epsilon: f64) -> bool {
        if self.directions.len() == 3 {
            return false;
        }
        let mut rest = direction;
        for &taken in &self.directions {
            rest -= taken.scaled(taken.dot(direction));
        }
        let [length, smallest] = [rest.length(), N::rounded(DIRECTION_MIN)];
        if length.value() >= smallest.value() {
            let unit = rest.divided(length);
            let missing = (speed - direction.dot(self.target)) / length;
            self.target += unit.scaled(missing);
            self.directions.push(unit);
        }
        length.is_close(smallest, epsilon)
    }

    /// Adds the drag of its contacts, times `sign`, to the system.
    pub(super) fn add_drags(
        &self,
        particle: usize,
        velocity: Vector<N>,
        sign: f64,
        system: &mut LinearSystem<N>,
    ) {
        for touch in self.touches.iter().filter(|touch| touch.drag != N::ZERO) {
            let drag = touch.drag * N::exact(sign);
            system.add_drag(particle, drag, touch.normal, velocity - touch.surface);
        }
    }
}

impl<N: Number> Constraints<N> {
    /// Those of particles that are held, and no others.
    #[must_use]
    pub fn of_pins(particles: &Particles<N>) -> Self {
        let of = |i| Constraint { held: particles.is_held(i), ..Constraint::default() };
        Self((0..particles.len()).map(of).collect())
    }

    /// Takes note of the particles that are held now.
    pub(crate) fn pins_update(&mut self, particles: &Particles<N>) {
        for (i, constraint) in self.0.iter_mut().enumerate() {
            constraint.held = particles.is_held(i);
        }
    }

    /// The part of `implicit_assemble` that is friction, for particles with these velocities.
    pub fn add_drags(&self, velocities: &[Vector<N>], system: &mut LinearSystem<N>) {
        for (i, (constraint, &velocity)) in self.0.iter().zip(velocities).enumerate() {
            constraint.add_drags(i, velocity, 1.0, system);
        }
    }

    /// `constraint_filter`: S y.
    pub(crate) fn filter(&self, y: &mut [Vector<N>]) {
        for (constraint, y) in self.0.iter().zip(y) {
            *y = constraint.filtered(*y);
        }
    }

    /// `constraint_project`: S y + z, for particles with these velocities.
    pub(crate) fn project(&self, y: &mut [Vector<N>], velocities: &[Vector<N>]) {
        for ((constraint, y), &velocity) in self.0.iter().zip(y).zip(velocities) {
            *y = constraint.filtered(*y) + constraint.change(velocity);
        }
    }
}
