//! NUMERICS §3: pressure and friction of the air.

use cloth_core::Model;

use super::Particles;
use crate::tracked::{Tracked, TrackedVector};

/// Adds a third of the force on each triangle to each of its corners.
pub fn aerodynamic_forces(
    model: &Model,
    particles: &Particles,
    wind_velocity: [f64; 3],
    forces: &mut [TrackedVector],
) {
    let Some(air) = model.air() else { return };
    let [half, third] = [0.5, 1.0 / 3.0].map(Tracked::rounded);
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
            let force = normal.scaled(pressure * across.abs() * across)
                + along.scaled(friction * along.length());
            let share = force.scaled(half * density * area * third);
            for corner in corners {
                forces[corner] += share;
            }
        }
    }
}
