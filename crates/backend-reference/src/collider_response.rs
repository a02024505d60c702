//! NUMERICS §7, `collider_response`: particles are taken out of colliders.

use cloth_core::{Collider, ColliderShape, Model, stepper::ColliderState};

use crate::{
    Number, Particles, Surface, Vector,
    surface::{half_thickness, surface_at, velocity_at},
};

/// What a collider did: the sum of its impulses, and of their moments about the origin.
pub type Impulse<N> = [Vector<N>; 2];

/// Where particles were at the start of a substep, and its length \[s\].
pub type PathStart<'a, N> = (&'a [Vector<N>], f64);

/// Looks at a path at most.
const LOOKS_MAX: u32 = 1024;

/// Pushes particles out of the colliders, one collider after the other, with Coulomb friction, and adds what each collider did
/// to its sum.
pub fn collider_response<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    colliders: &[ColliderState],
    start: Option<PathStart<'_, N>>,
    impulses: &mut [Impulse<N>],
) {
    let both = model.colliders().iter().zip(colliders);
    for (number, ((collider, state), impulse)) in both.zip(impulses).enumerate() {
        if !model.is_contact_body(number) {
            collide(model, particles, (collider, state), start, impulse);
        }
    }
}

/// The response of one collider.
pub fn collide<N: Number>(
    model: &Model,
    particles: &mut Particles<N>,
    (collider, state): (&Collider, &ColliderState),
    start: Option<PathStart<'_, N>>,
    sum: &mut Impulse<N>,
) {
    let epsilon = particles.epsilon;
    let [restitution, friction] = [collider.restitution, collider.friction].map(N::rounded);
    for i in 0..particles.len() {
        if particles.is_held(i) {
            continue;
        }
        let reach: N = half_thickness(model, i);
        let mut surface = surface_at(&collider.shape, state, particles.positions[i], epsilon);
        particles.doubt([i], surface.distance, reach);
        let touches = surface.distance.value() < reach.value();
        let passed = start.and_then(|(start, length)| {
            let path = [start[i], particles.positions[i]];
            sweep((&collider.shape, state), path, length, &surface, touches)
        });
        if let Some((place, met)) = passed {
            particles.positions[i] = place;
            surface = met;
        } else if !touches {
            continue;
        }
        particles.uncertain[i] |= surface.uncertain;
        let normal = surface.normal;
        particles.positions[i] += normal.scaled(reach - surface.distance);
        let carried = velocity_at(state, particles.positions[i]) + normal.scaled(surface.speed);
        let relative = particles.velocities[i] - carried;
        let approach = relative.dot(normal);
        // Near zero rounding decides on the branch; both give nearly the same.
        if approach.value() < 0.0 || approach.is_close(N::ZERO, epsilon) {
            let approach = approach.min(N::ZERO);
            let tangential = relative - normal.scaled(approach);
            let slip = tangential.length();
            let kept = if slip.value() > 0.0 {
                let lost = friction * (N::ONE + restitution) * approach.abs() / slip;
                (N::ONE - lost).max(N::ZERO)
            } else {
                N::ZERO
            };
            let before = particles.velocities[i];
            particles.velocities[i] =
                carried - normal.scaled(restitution * approach) + tangential.scaled(kept);
            let mass = N::rounded(model.masses()[i]);
            let impulse = (particles.velocities[i] - before).scaled(mass);
            sum[0] += impulse;
            sum[1] += particles.positions[i].cross(impulse);
        }
    }
}

/// Where a particle meets a collider that it has passed within a substep, and what it sees of it there. `end` is the surface
/// as seen from where it is now, within reach of which it may be.
fn sweep<N: Number>(
    (shape, state): (&ColliderShape, &ColliderState),
    [from, to]: [Vector<N>; 2],
    length: f64,
    end: &Surface<N>,
    touches: bool,
) -> Option<(Vector<N>, Surface<N>)> {
    // Of a half space nothing comes out on the other side; a grid may overestimate three times.
    let share = N::rounded(match shape {
        ColliderShape::Plane | ColliderShape::Surface(_) => return None,
        ColliderShape::Grid(_) => 0.25,
        _ => 0.875,
    });
    let h = N::rounded(length);
    let origin = Vector::rounded(state.translation);
    let angular = Vector::rounded(state.angular_velocity);
    let a = (from - origin) + Vector::rounded(state.linear_velocity).scaled(h);
    let b = angular.cross(a);
    let start = a + (b + angular.cross(b).scaled(h * N::rounded(0.5))).scaled(h);
    let way = (to - origin) - start;
    let far = way.length();
    // NaN goes nowhere.
    let is_long = far.value() > end.distance.value().abs();
    if !is_long {
        return None;
    }
    let direction = way.divided(far);
    let mut gone = N::ZERO;
    for look in 0..LOOKS_MAX {
        let place = origin + (start + direction.scaled(gone));
        let surface = surface_at(shape, state, place, 0.0);
        let distance = surface.distance.value();
        // NaN is not outside.
        let is_outside = distance >= 0.0;
        if look == 0 && !is_outside {
            return None;
        }
        if distance <= far.value() / 1024.0 {
            let is_other_side = surface.normal.dot(end.normal).value() < 0.0;
            let is_entered = direction.dot(surface.normal).value() < 0.0;
            return (is_entered && (!touches || is_other_side)).then_some((place, surface));
        }
        gone += share * surface.distance;
        let is_on_the_way = gone.value() < far.value();
        if !is_on_the_way {
            return None;
        }
    }
    None
}

/// Deepest intrusion of a free particle into the thickness around a collider; held ones are not moved by colliders.
#[must_use]
pub fn penetration_max<N: Number>(
    model: &Model,
    particles: &Particles<N>,
    colliders: &[ColliderState],
) -> N {
    let mut deepest = N::ZERO;
    for (i, &position) in particles.positions.iter().enumerate() {
        if particles.is_held(i) {
            continue;
        }
        let both = model.colliders().iter().zip(colliders).enumerate();
        for (_, (collider, state)) in both.filter(|&(number, _)| !model.is_contact_body(number)) {
            let surface = surface_at(&collider.shape, state, position, particles.epsilon);
            deepest = deepest.max(half_thickness::<N>(model, i) - surface.distance);
        }
    }
    deepest
}
