//! NUMERICS §5: how the force of the air changes with the velocity.

use cloth_core::Model;

use super::{
    super::{LENGTH_MIN, ONE, Particles},
    TrackedMatrix,
};
use crate::tracked::{Tracked, TrackedVector};

/// J of every particle \[N s/m\].
#[must_use]
pub fn air_jacobians(
    model: &Model,
    particles: &Particles,
    wind_velocity: [f64; 3],
) -> Vec<TrackedMatrix> {
    let mut jacobians = vec![TrackedMatrix::ZERO; particles.len()];
    let Some(air) = model.air() else { return jacobians };
    let [half, third, two] = [0.5, 1.0 / 3.0, 2.0].map(Tracked::rounded);
    let density = Tracked::rounded(air.density);
    let wind = TrackedVector::rounded(wind_velocity);
    for cloth in model.cloths() {
        let pressure = Tracked::rounded(cloth.aerodynamics.pressure);
        let friction = Tracked::rounded(cloth.aerodynamics.friction);
        let triangles = cloth.triangles.start as usize..cloth.triangles.end as usize;
        for corners in &model.triangles()[triangles] {
            let corners = corners.map(|corner| corner as usize);
            let [a, b, c] = corners.map(|corner| particles.positions[corner]);
            let area_vector = (b - a).cross(c - a).scaled(half);
            let area = area_vector.length();
            if area.value == 0.0 {
                continue;
            }
            let normal = area_vector.divided(area);
            let [a, b, c] = corners.map(|corner| particles.velocities[corner]);
            let relative = wind - (a + b + c).scaled(third);
            let across = relative.dot(normal);
            let along = relative - normal.scaled(across);
            let speed = along.length();
            let direction = along.divided(speed.max(LENGTH_MIN));
            let normals = TrackedMatrix::outer(normal, normal);
            let tangents = TrackedMatrix::diagonal(ONE)
                + normals.negated()
                + TrackedMatrix::outer(direction, direction);
            let share =
                normals.scaled(two * pressure * across.abs()) + tangents.scaled(friction * speed);
            let share = share.scaled(half * density * area * third);
            for corner in corners {
                jacobians[corner] += share;
            }
        }
    }
    jacobians
}
