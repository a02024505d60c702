//! NUMERICS §7: contact with solid shapes, and particles that may have passed one.

use cloth_backend_reference::{PathStart, collide, surface_at, velocity_at};
use cloth_core::{ColliderShape, Model, stepper::ColliderState};

use super::{Particles, TrackedImpulse};
use crate::tracked::{Tracked, TrackedVector};

/// Places on a path that are looked at.
const PLACES: u32 = 400;

/// Whether the path of a particle may be said to go through a collider: it comes near the surface from outside.
/// Where it meets it is another matter, with a test of its own.
fn may_pass(
    shape: &ColliderShape,
    collider: &ColliderState,
    [start, end]: [TrackedVector; 2],
    length: f64,
) -> bool {
    if matches!(shape, ColliderShape::Plane) {
        return false;
    }
    let [start, end] = [start, end].map(|place| place.0.map(|component| component.value));
    let distance = |place: [f64; 3]| {
        surface_at(shape, collider, TrackedVector::exact(place), 0.0).distance.value
    };
    // The start as the collider sees it: carried along, then turned little by little.
    let linear = collider.linear_velocity;
    let mut first: [f64; 3] = std::array::from_fn(|k| start[k] + length * linear[k]);
    for _ in 0..PLACES {
        let carried = velocity_at(collider, TrackedVector::exact(first)).0;
        let turned = |k: usize| length / f64::from(PLACES) * (carried[k].value - linear[k]);
        first = std::array::from_fn(|k| first[k] + turned(k));
    }
    let way: [f64; 3] = std::array::from_fn(|k| end[k] - first[k]);
    let gone = way.iter().map(|component| component * component).sum::<f64>().sqrt();
    if gone < 0.9 * distance(end).abs() {
        return false;
    }
    (0..=PLACES).any(|place| {
        let share = f64::from(place) / f64::from(PLACES);
        distance(std::array::from_fn(|k| first[k] + share * way[k])) < gone / 500.0
    })
}

/// Pushes particles out of the colliders. Returns what each collider did. Particles whose path may lead through a collider are
/// uncertain.
pub fn collider_response(
    model: &Model,
    particles: &mut Particles,
    colliders: &[ColliderState],
    start: Option<PathStart<'_, Tracked>>,
) -> Vec<TrackedImpulse> {
    let mut impulses = vec![TrackedImpulse::default(); colliders.len()];
    let both = model.colliders().iter().zip(colliders);
    for ((collider, state), impulse) in both.zip(&mut impulses) {
        if let Some((start, length)) = start {
            for i in (0..particles.len()).filter(|&i| particles.inverse_masses[i].value > 0.0) {
                let path = [start[i], particles.positions[i]];
                particles.uncertain[i] |= may_pass(&collider.shape, state, path, length);
            }
        }
        collide(model, particles, (collider, state), None, impulse);
    }
    impulses
}
