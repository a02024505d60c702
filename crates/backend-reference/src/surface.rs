//! NUMERICS §7: colliders as signed distances.

use cloth_core::{ColliderShape, DistanceGrid, GridSets, Model, stepper::ColliderState};

use crate::{Number, Vector};

/// What a place sees of a collider.
pub struct Surface<N> {
    /// Signed distance \[m\].
    pub distance: N,
    /// Its gradient, a unit vector.
    pub normal: Vector<N>,
    /// Velocity along the normal, beside that of the collider as a whole \[m/s\].
    pub speed: N,
    /// Rounding decides which normal it is.
    pub uncertain: bool,
}

fn axis<N: Number>(k: usize, sign: f64) -> Vector<N> {
    Vector::exact(std::array::from_fn(|m| if m == k { sign } else { 0.0 }))
}

/// A ball of this radius around the origin of `offset`; `fallback` is the normal in its centre.
fn ball<N: Number>(
    offset: Vector<N>,
    radius: f64,
    fallback: Vector<N>,
    epsilon: f64,
) -> Surface<N> {
    let length = offset.length();
    let is_centre = length.value() == 0.0;
    Surface {
        distance: length - N::rounded(radius),
        normal: if is_centre { fallback } else { offset.divided(length) },
        speed: N::ZERO,
        uncertain: length != N::ZERO && length.is_close(N::ZERO, epsilon),
    }
}

/// Trilinear interpolation, as a sum over the eight samples with a weight for each.
fn sampled<N: Number>(grid: &DistanceGrid, sets: GridSets, local: Vector<N>) -> Surface<N> {
    let mut cell = [0; 3];
    let mut share = [N::ZERO; 3];
    let mut beyond = Vector::<N>::ZERO;
    let spacing = N::rounded(grid.spacing);
    for axis in 0..3 {
        let place = (local.0[axis] - N::rounded(grid.origin[axis])) / spacing;
        let last = f64::from(grid.size[axis] - 1);
        let inside = place.max(N::ZERO).min(N::exact(last));
        beyond.0[axis] = spacing * (place - inside);
        cell[axis] = inside.value().floor().min(last - 1.0) as usize;
        share[axis] = inside - N::exact(cell[axis] as f64);
    }
    let mut distance = beyond.length();
    let mut change = N::ZERO;
    let mut gradient = Vector::<N>::ZERO;
    let part = N::rounded(sets.share);
    for corner in 0..8_usize {
        let bit = |axis: usize| corner >> axis & 1;
        let [i, j, k] = [0, 1, 2].map(|axis| cell[axis] + bit(axis));
        let [width, height] = [grid.size[0] as usize, grid.size[1] as usize];
        let of_set = |set: u32| {
            let first = set as usize * grid.samples();
            N::exact(f64::from(grid.distances[first + (k * height + j) * width + i]))
        };
        let difference = of_set(sets.next) - of_set(sets.index);
        let sample = of_set(sets.index) + part * difference;
        let weights = [0, 1, 2].map(|a| if bit(a) == 1 { share[a] } else { N::ONE - share[a] });
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
        let [low, high] = [share[axis].value(), 1.0 - share[axis].value()];
        low.min(high) < 1e-3
    };
    Surface {
        distance,
        normal: if length.value() > 0.0 { gradient.divided(length) } else { axis(2, 1.0) },
        speed: -(N::rounded(grid.rate) * change),
        // The gradient jumps from cell to cell.
        uncertain: length.value() < 1e-3 || (0..3).any(near_face),
    }
}

/// The surface in the local frame.
fn surface<N: Number>(
    shape: &ColliderShape,
    sets: GridSets,
    local: Vector<N>,
    epsilon: f64,
) -> Surface<N> {
    match *shape {
        ColliderShape::Plane => {
            Surface { distance: local.0[2], normal: axis(2, 1.0), speed: N::ZERO, uncertain: false }
        }
        ColliderShape::Sphere { radius } => ball(local, radius, axis(2, 1.0), epsilon),
        ColliderShape::Capsule { half_length, radius } => {
            let end = N::rounded(half_length);
            let [x, y, z] = local.0;
            let nearest = z.max(-end).min(end);
            ball(Vector([x, y, z - nearest]), radius, axis(0, 1.0), epsilon)
        }
        ColliderShape::Grid(ref grid) => sampled(grid, sets, local),
        // It has no inside.
        ColliderShape::Surface(_) => Surface {
            distance: N::exact(f64::INFINITY),
            normal: axis(2, 1.0),
            speed: N::ZERO,
            uncertain: false,
        },
        ColliderShape::Box { half_extents } => {
            let extents = Vector::rounded(half_extents);
            let outside = local.each(extents, |p, h| p.abs() - h);
            let signs = local.0.map(|p| if p.value() < 0.0 { -1.0 } else { 1.0 });
            if outside.0.iter().any(|q| q.value() > 0.0) {
                let beyond = Vector(outside.0.map(|q| q.max(N::ZERO)));
                let length = beyond.length();
                let direction = beyond.divided(length);
                let signs = Vector::exact(signs);
                let normal = direction.each(signs, |n, s| n * s);
                return Surface { distance: length, normal, speed: N::ZERO, uncertain: false };
            }
            let is_nearer = |k: usize, than: usize| outside.0[k].value() > outside.0[than].value();
            let nearest = (1..3).fold(0, |best, k| if is_nearer(k, best) { k } else { best });
            let rival =
                |k: usize| k != nearest && outside.0[k].is_close(outside.0[nearest], epsilon);
            Surface {
                distance: outside.0[nearest],
                normal: axis(nearest, signs[nearest]),
                speed: N::ZERO,
                uncertain: (0..3).any(rival) || local.0[nearest].is_close(N::ZERO, epsilon),
            }
        }
    }
}

/// The surface of a collider as seen from `position`, normal in world coordinates.
#[must_use]
pub fn surface_at<N: Number>(
    shape: &ColliderShape,
    collider: &ColliderState,
    position: Vector<N>,
    epsilon: f64,
) -> Surface<N> {
    let rows = collider.rotation.map(Vector::rounded);
    let arm = position - Vector::rounded(collider.translation);
    let columns: [Vector<N>; 3] =
        std::array::from_fn(|k| Vector(std::array::from_fn(|row| rows[row].0[k])));
    let local = Vector(columns.map(|column| column.dot(arm)));
    let mut surface = surface(shape, collider.sets, local, epsilon);
    surface.normal = Vector(rows.map(|row| row.dot(surface.normal)));
    surface
}

/// How near a particle comes to a collider \[m\]: t/2, less where triangles touch.
pub(crate) fn half_thickness<N: Number>(model: &Model, particle: usize) -> N {
    let cloth = model.cloth_of(particle as u32);
    N::rounded(model.collider_offsets().nth(cloth).map_or(0.0, |(_, offset)| offset))
}

/// Velocity of a collider at a place \[m/s\].
#[must_use]
pub fn velocity_at<N: Number>(collider: &ColliderState, position: Vector<N>) -> Vector<N> {
    let arm = position - Vector::rounded(collider.translation);
    Vector::rounded(collider.linear_velocity)
        + Vector::rounded(collider.angular_velocity).cross(arm)
}
