//! Which particle a ray from the eye meets.

use cloth::Model;
use glam::DVec3;

use crate::Ray;

/// A particle under the pointer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pick {
    pub(super) particle: u32,
    /// Distance along the ray \[m\].
    pub(super) distance: f64,
}

/// The corner nearest to where the ray first meets a triangle; if it meets none, the particle
/// nearest to the ray, if it is no farther from it than `reach`, the part of the distance.
pub(super) fn pick(model: &Model, positions: &[[f64; 3]], ray: &Ray, reach: f64) -> Option<Pick> {
    let (origin, direction) = (DVec3::from(ray.origin), DVec3::from(ray.direction));
    let point = |particle: u32| DVec3::from(positions[particle as usize]);
    let hits = model.triangles().iter().filter_map(|&triangle| {
        let distance = triangle_distance(origin, direction, triangle.map(point))?;
        Some((distance, triangle))
    });
    if let Some((distance, triangle)) = hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
        let hit = origin + distance * direction;
        let particle = triangle.into_iter().min_by(|&a, &b| {
            point(a).distance_squared(hit).total_cmp(&point(b).distance_squared(hit))
        })?;
        return Some(Pick { particle, distance });
    }
    let near = (0..).zip(positions).filter_map(|(particle, &position)| {
        let offset = DVec3::from(position) - origin;
        let distance = offset.dot(direction);
        let aside = (offset - distance * direction).length();
        (distance > 0.0 && aside <= reach * distance).then_some((aside, particle, distance))
    });
    near.min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, particle, distance)| Pick { particle, distance })
}

/// Where a ray meets a triangle, seen from either side (Möller and Trumbore 1997).
fn triangle_distance(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (u_side, v_side) = (b - a, c - a);
    let p = direction.cross(v_side);
    let determinant = u_side.dot(p);
    if determinant.abs() < 1e-300 {
        return None;
    }
    let offset = origin - a;
    let u = offset.dot(p) / determinant;
    let q = offset.cross(u_side);
    let v = direction.dot(q) / determinant;
    let distance = v_side.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
}
