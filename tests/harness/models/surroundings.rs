//! Colliders, fields, air and contact.

use std::sync::Arc;

use cloth_core::{
    Air, Collider, ColliderShape, ContactResponse, DistanceGrid, Field, FieldProgram, Gust,
    Inflation, Pose, SelfContact,
};
use glam::DQuat;

use super::description::Contact;
use crate::{random::Random, stages::procedural_source};

/// A rotation and a place within `size` \[m\] of `centre` \[m\].
pub(super) fn random_pose(centre: [f64; 3], size: f64, random: &mut Random) -> Pose {
    let offset = random.vector(size);
    let turn = DQuat::from_axis_angle(random.direction().into(), random.between(0.0, 6.0));
    Pose {
        translation: std::array::from_fn(|k| centre[k] + offset[k]),
        rotation: turn.normalize().into(),
    }
}

/// A pose not far from another one: where a collider is a frame later.
pub(super) fn pose_nearby(pose: &Pose, random: &mut Random) -> Pose {
    let step = random.vector(0.02);
    let turn = DQuat::from_axis_angle(random.direction().into(), random.between(0.0, 0.1));
    let rotation = (turn * DQuat::from_array(pose.rotation)).normalize();
    Pose {
        translation: std::array::from_fn(|k| pose.translation[k] + step[k]),
        rotation: rotation.into(),
    }
}

/// Most colliders of a generated case.
pub(super) const COLLIDERS_MAX: usize = 6;

/// Samples of a box with round edges and dents, between two of which the distance is anything but linear.
fn distance_grid(random: &mut Random) -> DistanceGrid {
    let half = [0, 1, 2].map(|_| random.between(0.05, 0.15));
    let [radius, dent] = [random.between(0.02, 0.05), random.between(0.0, 0.01)];
    let spacing = random.between(0.03, 0.06);
    let reach = half.map(|half| half + radius + 0.1);
    let size = reach.map(|reach| (2.0 * reach / spacing).ceil() as u32 + 1);
    let origin = [0, 1, 2].map(|k| -0.5 * spacing * f64::from(size[k] - 1));
    let mut distances = Vec::new();
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let index = [x, y, z].map(f64::from);
                let at: [f64; 3] = std::array::from_fn(|k| origin[k] + spacing * index[k]);
                let beyond: [f64; 3] = std::array::from_fn(|k| at[k].abs() - half[k]);
                let outside = glam::DVec3::from(beyond).max(glam::DVec3::ZERO).length();
                let inside = beyond.into_iter().fold(f64::NEG_INFINITY, f64::max).min(0.0);
                let wave: f64 = at.iter().map(|p| (20.0 * p).sin()).product();
                distances.push((outside + inside - radius + dent * wave) as f32);
            }
        }
    }
    // Half of them grow and shrink by a few millimetres, in a few milliseconds.
    let rate = random.between(100.0, 2000.0);
    let sets = if random.between(0.0, 1.0) < 0.5 { 1 } else { 3 };
    let first = distances.len();
    for _ in 1..sets {
        for at in 0..first {
            distances.push(distances[at] + random.between(-0.005, 0.005) as f32);
        }
    }
    DistanceGrid { origin, spacing, size, distances, rate, ..DistanceGrid::default() }
}

/// The collider with this number; five in a row have all five shapes.
pub(super) fn collider(number: usize, centre: [f64; 3], random: &mut Random) -> Collider {
    if number % 5 == 4 {
        let grid = Arc::new(distance_grid(random));
        return with_shape(number, ColliderShape::Grid(grid), centre, random);
    }
    let mut size = || random.between(0.05, 0.2);
    let shape = match number % 5 {
        0 => ColliderShape::Sphere { radius: size() },
        1 => ColliderShape::Box { half_extents: [size(), size(), size()] },
        2 => ColliderShape::Capsule { half_length: size(), radius: size() },
        _ => ColliderShape::Plane,
    };
    with_shape(number, shape, centre, random)
}

fn with_shape(
    number: usize,
    shape: ColliderShape,
    centre: [f64; 3],
    random: &mut Random,
) -> Collider {
    Collider {
        name: format!("collider {number}"),
        shape,
        pose: random_pose(centre, 0.3, random),
        // A third have none.
        friction: random.between(-0.5, 1.0).max(0.0),
        restitution: random.between(-0.5, 1.0).max(0.0),
    }
}

/// Fields before the first procedural one.
pub(super) const FIELDS_SUMMED: usize = 3;

/// A field: uniform and drag in turns, then the expressions.
pub(super) fn field(number: usize, random: &mut Random) -> Field {
    if let Some(expression) = number.checked_sub(FIELDS_SUMMED) {
        let source = procedural_source(expression);
        match FieldProgram::compile(source) {
            Ok(program) => Field::Procedural { program: Arc::new(program) },
            Err(error) => panic!("{source}: {error}"),
        }
    } else if number.is_multiple_of(2) {
        Field::Drag { rate: [0, 1, 2].map(|_| random.between(0.0, 2.0)) }
    } else {
        Field::Uniform { acceleration: random.vector(5.0) }
    }
}

/// Air with a wind and gusts.
pub(super) fn air(random: &mut Random) -> Air {
    Air {
        density: random.between(0.5, 1.5),
        wind_velocity: random.vector(5.0),
        gust: Some(Gust {
            amplitude: random.between(0.0, 1.0),
            frequency: random.between(0.1, 5.0),
        }),
    }
}

/// Gas in a cloth, before, during or after its rise.
pub(super) fn gas(cloth: String, random: &mut Random) -> Inflation {
    let start = random.between(0.0, 0.01);
    let rise = [start, start + random.between(0.0, 0.01)];
    Inflation { cloth, pressure: random.between(-5.0, 5.0), rise }
}

/// Contact at about one `spacing` \[m\].
pub(super) fn self_contact(
    contact: Contact,
    spacing: f64,
    random: &mut Random,
) -> Option<SelfContact> {
    let response = match contact {
        Contact::Off => return None,
        Contact::Impulse => ContactResponse::Impulse {
            restitution: random.between(0.0, 1.0),
            friction: random.between(0.0, 1.0),
        },
        Contact::Penalty => ContactResponse::Penalty {
            stiffness: random.logarithmic(1.0, 100.0),
            damping: random.between(0.0, 0.05),
        },
    };
    Some(SelfContact { distance: spacing * random.between(0.5, 1.3), response })
}
