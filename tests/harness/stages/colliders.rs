//! NUMERICS §7: contact with solid shapes.

use cloth_core::{ColliderShape, DistanceGrid, GridSets, Model, stepper::ColliderState};

use super::{ONE, Particles, ZERO};
use crate::tracked::{Tracked, TrackedVector};

/// Signed distance and normal of a shape, in its local frame.
pub(super) struct Surface {
    pub(super) distance: Tracked,
    pub(super) normal: TrackedVector,
    /// Velocity along the normal, beside that of the collider as a whole.
    pub(super) speed: Tracked,
    /// Rounding decides which normal it is.
    pub(super) uncertain: bool,
}

fn axis(k: usize, sign: f64) -> TrackedVector {
    TrackedVector::exact(std::array::from_fn(|m| if m == k { sign } else { 0.0 }))
}

/// A ball of this radius around the origin of `offset`; `fallback` is the normal in its centre.
fn ball(offset: TrackedVector, radius: f64, fallback: TrackedVector, epsilon: f64) -> Surface {
    let length = offset.length();
    let is_centre = length.value == 0.0;
    Surface {
        distance: length - Tracked::rounded(radius),
        normal: if is_centre { fallback } else { offset.divided(length) },
        speed: ZERO,
        uncertain: length.error > 0.0 && length.is_close(ZERO, epsilon),
    }
}

/// Trilinear interpolation, as a sum over the eight samples with a weight for each.
fn sampled(grid: &DistanceGrid, sets: GridSets, local: TrackedVector) -> Surface {
    let mut cell = [0; 3];
    let mut share = [ZERO; 3];
    let mut beyond = TrackedVector::ZERO;
    let spacing = Tracked::rounded(grid.spacing);
    for axis in 0..3 {
        let place = (local.0[axis] - Tracked::rounded(grid.origin[axis])) / spacing;
        let last = f64::from(grid.size[axis] - 1);
        let inside = place.max(ZERO).min(Tracked::exact(last));
        beyond.0[axis] = spacing * (place - inside);
        cell[axis] = inside.value.floor().min(last - 1.0) as usize;
        share[axis] = inside - Tracked::exact(cell[axis] as f64);
    }
    let mut distance = beyond.length();
    let mut change = ZERO;
    let mut gradient = TrackedVector::ZERO;
    let part = Tracked::rounded(sets.share);
    for corner in 0..8_usize {
        let bit = |axis: usize| corner >> axis & 1;
        let [i, j, k] = [0, 1, 2].map(|axis| cell[axis] + bit(axis));
        let [width, height] = [grid.size[0] as usize, grid.size[1] as usize];
        let of_set = |set: u32| {
            let first = set as usize * grid.samples();
            Tracked::exact(f64::from(grid.distances[first + (k * height + j) * width + i]))
        };
        let difference = of_set(sets.next) - of_set(sets.index);
        let sample = of_set(sets.index) + part * difference;
        let weights = [0, 1, 2].map(|a| if bit(a) == 1 { share[a] } else { ONE - share[a] });
        let [x, y, z] = weights;
        distance += sample * (x * y * z);
        change += difference * (x * y * z);
        for (axis, others) in [y * z, x * z, x * y].into_iter().enumerate() {
            let signed = if bit(axis) == 1 { sample } else { -sample };
            gradient.0[axis] += signed * others;
        }
    }
    let length = gradient.length();
    let near_face = |axis: usize| {
        let [low, high] = [share[axis].value, 1.0 - share[axis].value];
        low.min(high) < 1e-3
    };
    Surface {
        distance,
        normal: gradient.divided(length),
        speed: -(Tracked::rounded(grid.rate) * change),
        // The gradient jumps from cell to cell.
        uncertain: length.value < 1e-3 || (0..3).any(near_face),
    }
}

fn surface(shape: &ColliderShape, sets: GridSets, local: TrackedVector, epsilon: f64) -> Surface {
    match *shape {
        ColliderShape::Plane => {
            Surface { distance: local.0[2], normal: axis(2, 1.0), speed: ZERO, uncertain: false }
        }
        ColliderShape::Sphere { radius } => ball(local, radius, axis(2, 1.0), epsilon),
        ColliderShape::Capsule { half_length, radius } => {
            let end = Tracked::rounded(half_length);
            let [x, y, z] = local.0;
            let nearest = z.max(-end).min(end);
            ball(TrackedVector([x, y, z - nearest]), radius, axis(0, 1.0), epsilon)
        }
        ColliderShape::Grid(ref grid) => sampled(grid, sets, local),
        ColliderShape::Box { half_extents } => {
            let extents = TrackedVector::rounded(half_extents);
            let outside = local.each(extents, |p, h| p.abs() - h);
            let signs = local.0.map(|p| if p.value < 0.0 { -1.0 } else { 1.0 });
            if outside.0.iter().any(|q| q.value > 0.0) {
                let beyond = TrackedVector(outside.0.map(|q| q.max(ZERO)));
                let length = beyond.length();
                let direction = beyond.divided(length);
                let signs = TrackedVector::exact(signs);
                let normal = direction.each(signs, |n, s| n * s);
                return Surface { distance: length, normal, speed: ZERO, uncertain: false };
            }
            let nearest =
                (1..3).fold(
                    0,
                    |best, k| {
                        if outside.0[k].value > outside.0[best].value { k } else { best }
                    },
                );
            let rival =
                |k: usize| k != nearest && outside.0[k].is_close(outside.0[nearest], epsilon);
            Surface {
                distance: outside.0[nearest],
                normal: axis(nearest, signs[nearest]),
                speed: ZERO,
                uncertain: (0..3).any(rival) || local.0[nearest].is_close(ZERO, epsilon),
            }
        }
    }
}

/// The surface of a collider as seen from `position`, normal in world coordinates.
pub(super) fn surface_at(
    shape: &ColliderShape,
    collider: &ColliderState,
    position: TrackedVector,
    epsilon: f64,
) -> Surface {
    let rows = collider.rotation.map(TrackedVector::rounded);
    let arm = position - TrackedVector::rounded(collider.translation);
    let columns: [TrackedVector; 3] =
        std::array::from_fn(|k| TrackedVector(std::array::from_fn(|row| rows[row].0[k])));
    let local = TrackedVector(columns.map(|column| column.dot(arm)));
    let mut surface = surface(shape, collider.sets, local, epsilon);
    surface.normal = TrackedVector(rows.map(|row| row.dot(surface.normal)));
    surface
}

pub(super) fn half_thickness(model: &Model, particle: usize) -> Tracked {
    Tracked::rounded(0.5 * model.cloths()[model.cloth_of(particle as u32)].thickness)
}

/// Velocity of a collider at a place.
pub(super) fn carried(collider: &ColliderState, position: TrackedVector) -> TrackedVector {
    let arm = position - TrackedVector::rounded(collider.translation);
    TrackedVector::rounded(collider.linear_velocity)
        + TrackedVector::rounded(collider.angular_velocity).cross(arm)
}

/// What a collider did: the sum of its impulses, and of their moments about the origin.
pub type TrackedImpulse = [TrackedVector; 2];

/// Where particles were at the start of a substep, and its length \[s\].
pub type PathStart<'a> = (&'a [TrackedVector], f64);

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
        let carried = carried(collider, TrackedVector::exact(first)).0;
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

/// Pushes particles out of the colliders, one collider after the other, with Coulomb friction. Returns what each
/// collider did. Particles whose path may lead through a collider are uncertain.
pub fn collider_response(
    model: &Model,
    particles: &mut Particles,
    colliders: &[ColliderState],
    start: Option<PathStart<'_>>,
    epsilon: f64,
) -> Vec<TrackedImpulse> {
    let mut impulses = vec![[TrackedVector::ZERO; 2]; colliders.len()];
    for i in 0..particles.len() {
        if particles.inverse_masses[i].value == 0.0 {
            continue;
        }
        let reach = half_thickness(model, i);
        let mass = Tracked::rounded(model.masses()[i]);
        for ((description, collider), sum) in
            model.colliders().iter().zip(colliders).zip(&mut impulses)
        {
            let surface = surface_at(&description.shape, collider, particles.positions[i], epsilon);
            if let Some((start, length)) = start {
                let path = [start[i], particles.positions[i]];
                particles.uncertain[i] |= may_pass(&description.shape, collider, path, length);
            }
            particles.uncertain[i] |= surface.distance.is_close(reach, epsilon);
            if surface.distance.value >= reach.value {
                continue;
            }
            particles.uncertain[i] |= surface.uncertain;
            let normal = surface.normal;
            particles.positions[i] += normal.scaled(reach - surface.distance);
            let [restitution, friction] =
                [description.restitution, description.friction].map(Tracked::rounded);
            let carried = carried(collider, particles.positions[i]) + normal.scaled(surface.speed);
            let relative = particles.velocities[i] - carried;
            let approach = relative.dot(normal);
            // Near zero rounding decides on the branch; both give nearly the same.
            if approach.value < 0.0 || approach.is_close(ZERO, epsilon) {
                let approach = approach.min(ZERO);
                let tangential = relative - normal.scaled(approach);
                let slip = tangential.length();
                let kept = if slip.value > 0.0 {
                    (ONE - friction * (ONE + restitution) * approach.abs() / slip).max(ZERO)
                } else {
                    ZERO
                };
                let before = particles.velocities[i];
                particles.velocities[i] =
                    carried - normal.scaled(restitution * approach) + tangential.scaled(kept);
                let impulse = (particles.velocities[i] - before).scaled(mass);
                sum[0] += impulse;
                sum[1] += particles.positions[i].cross(impulse);
            }
        }
    }
    impulses
}

/// Deepest intrusion of a free particle into the thickness around a collider; held ones are not
/// moved by colliders.
#[must_use]
pub fn penetration_max(
    model: &Model,
    particles: &Particles,
    colliders: &[ColliderState],
    epsilon: f64,
) -> Tracked {
    let mut deepest = ZERO;
    for (i, &position) in particles.positions.iter().enumerate() {
        if particles.inverse_masses[i].value == 0.0 {
            continue;
        }
        for (description, collider) in model.colliders().iter().zip(colliders) {
            let surface = surface_at(&description.shape, collider, position, epsilon);
            deepest = deepest.max(half_thickness(model, i) - surface.distance);
        }
    }
    deepest
}
