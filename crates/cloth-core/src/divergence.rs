//! Why a simulation diverged, as far as the state before tells.

use crate::{ColliderShape, DivergenceOrigin, Field, Model, SpringClass, State};

/// A field moves particles too far if it does so by more than this share of a spring in one substep.
const SHARE_MAX: f64 = 0.5;

/// Looks for what made a simulation diverge that was at `state` before, and had come to `time` \[s\] in substeps of
/// `time_step` \[s\]: a free particle inside a collider, or a field that no spring can follow.
#[must_use]
pub fn divergence_origin(
    model: &Model,
    state: &State,
    time: f64,
    time_step: f64,
) -> DivergenceOrigin {
    let field = strong_field(model, state, time, time_step);
    field.or_else(|| inside(model, state)).unwrap_or_default()
}

/// The free particle that is deepest inside a collider.
fn inside(model: &Model, state: &State) -> Option<DivergenceOrigin> {
    let mut deepest = (0.0, None);
    for (i, (&position, &held)) in state.positions.iter().zip(&state.held).enumerate() {
        if held != 0 {
            continue;
        }
        for (collider, pose) in model.colliders().iter().zip(&state.colliders) {
            let depth = -collider.shape.distance_at(pose, position, state.time);
            if depth > deepest.0 {
                deepest = (depth, Some((i as u32, collider)));
            }
        }
    }
    let (depth, place) = deepest;
    // What rounding leaves within a plane is no start inside.
    let (particle, collider) = place.filter(|_| depth > 1e-3 * thickness_min(model))?;
    Some(DivergenceOrigin::Inside { particle, collider: collider.name.clone(), depth })
}

fn thickness_min(model: &Model) -> f64 {
    model.cloths().iter().map(|cloth| cloth.thickness).fold(f64::INFINITY, f64::min)
}

/// The field with the largest acceleration, if that is too large.
fn strong_field(
    model: &Model,
    state: &State,
    time: f64,
    time_step: f64,
) -> Option<DivergenceOrigin> {
    let threads = model.springs().kinds().iter().filter(|kind| kind.class != SpringClass::Seam);
    let shortest = threads.map(|kind| kind.rest_length).fold(f64::INFINITY, f64::min);
    // Without springs only what is not finite is too much.
    let allowed = if shortest.is_finite() { SHARE_MAX * shortest } else { f64::MAX };
    let mut worst: Option<(f64, DivergenceOrigin)> = None;
    let mut consider = |field: Option<usize>, particle: u32, acceleration: [f64; 3]| {
        let size = acceleration.iter().map(|a| a * a).sum::<f64>().sqrt();
        let way = size * time_step * time_step;
        // Written so that NaN is too much.
        let is_small = way <= allowed;
        let is_worse = worst.as_ref().is_none_or(|(most, _)| size.total_cmp(most).is_gt());
        if !is_small && is_worse {
            worst = Some((size, DivergenceOrigin::Field { field, particle, acceleration: size }));
        }
    };
    consider(None, 0, model.uniform_acceleration());
    let fields = model.fields().iter().enumerate();
    for (number, field) in fields {
        let Field::Procedural { program } = field else { continue };
        for (i, (&x, &v)) in state.positions.iter().zip(&state.velocities).enumerate() {
            let mass = model.masses()[i];
            if state.held[i] != 0 {
                continue;
            }
            for moment in [state.time, time] {
                let force = program.evaluate(x, v, moment, mass, i, time_step);
                consider(Some(number), i as u32, force.map(|component| component / mass));
            }
        }
    }
    worst.map(|(_, origin)| origin)
}

impl ColliderShape {
    /// Distance of a point of the world from the surface of this shape at `pose` \[m\], negative inside; that of a shape that changes
    /// at `time` \[s\].
    #[must_use]
    pub fn distance_at(&self, pose: &crate::Pose, point: [f64; 3], time: f64) -> f64 {
        let rows = pose.rotation_rows();
        let arm: [f64; 3] = std::array::from_fn(|k| point[k] - pose.translation[k]);
        let local: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|row| rows[row][k] * arm[row]).sum());
        let length = |vector: [f64; 3]| vector.iter().map(|c| c * c).sum::<f64>().sqrt();
        match self {
            Self::Plane => local[2],
            Self::Sphere { radius } => length(local) - radius,
            Self::Capsule { half_length, radius } => {
                let along = local[2].clamp(-half_length, *half_length);
                length([local[0], local[1], local[2] - along]) - radius
            }
            Self::Box { half_extents } => {
                let beyond: [f64; 3] = std::array::from_fn(|k| local[k].abs() - half_extents[k]);
                let inside = beyond.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                length(beyond.map(|b| b.max(0.0))) + inside.min(0.0)
            }
            Self::Grid(grid) => grid.distance_at(local, time),
            // It has no inside.
            Self::Surface(_) => f64::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pose;

    #[test]
    fn distances_of_shapes() {
        let pose = Pose::from_z_axis([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        let at = |shape: ColliderShape, point| shape.distance_at(&pose, point, 0.0);
        let close = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-12, "{found}");
        close(at(ColliderShape::Plane, [1.5, 7.0, 3.0]), 0.5);
        close(at(ColliderShape::Sphere { radius: 0.5 }, [1.0, 3.0, 4.0]), 4.5);
        let capsule = ColliderShape::Capsule { half_length: 2.0, radius: 0.5 };
        close(at(capsule.clone(), [2.5, 0.0, 1.0]), 0.5);
        close(at(capsule, [4.0, 0.0, 0.0]), 0.5);
        let solid = ColliderShape::Box { half_extents: [1.0, 1.0, 2.0] };
        close(at(solid.clone(), [1.0, 0.0, 0.25]), -0.75);
        close(at(solid, [6.0, 0.0, 0.0]), 3.0);
    }
}
