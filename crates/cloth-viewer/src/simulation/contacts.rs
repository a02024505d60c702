//! Particles in contact, and the cells in which they are looked for; for the eye only.

use std::collections::HashMap;

use cloth::{ColliderShape, Model, State};
use glam::{DMat3, DQuat, DVec3};

use crate::{LineEnd, PlaceLine};

/// Most cells that are drawn.
const CELL_LIMIT: usize = 20_000;
/// Colour of cells.
const CELL: [u8; 4] = [120, 70, 190, 110];

type Cells = HashMap<[i32; 3], Vec<u32>>;

fn cells(positions: &[[f64; 3]], side: f64) -> Cells {
    let mut cells = Cells::new();
    for (particle, position) in (0..).zip(positions) {
        let cell = position.map(|x| (x / side).floor().clamp(-1e9, 1e9) as i32);
        cells.entry(cell).or_default().push(particle);
    }
    cells
}

/// Particles that touch a collider, or another particle to which no spring joins them.
pub(super) fn contact_particles(model: &Model, state: &State) -> Vec<u32> {
    let mut touching = vec![false; state.len()];
    if let Some(contact) = model.self_contact() {
        self_contacts(model, state, contact.distance, &mut touching);
    }
    for (collider, pose) in model.colliders().iter().zip(&state.colliders) {
        let inverse = DMat3::from_quat(DQuat::from_array(pose.rotation)).transpose();
        for cloth in model.cloths() {
            // A little more than the distance at which particles are stopped.
            let reach = 0.5 * cloth.thickness * 1.1 + 1e-5;
            let range = cloth.particles.start as usize..cloth.particles.end as usize;
            for (&position, touches) in
                state.positions[range.clone()].iter().zip(&mut touching[range])
            {
                let offset = DVec3::from(position) - DVec3::from(pose.translation);
                *touches |= signed_distance(&collider.shape, inverse * offset, state.time) < reach;
            }
        }
    }
    (0..).zip(touching).filter_map(|(particle, touches)| touches.then_some(particle)).collect()
}

fn self_contacts(model: &Model, state: &State, distance: f64, touching: &mut [bool]) {
    let cells = cells(&state.positions, distance);
    let rest = model.positions();
    let near = |points: &[[f64; 3]], a: u32, b: u32| {
        DVec3::from(points[a as usize]).distance_squared(points[b as usize].into())
            < distance * distance
    };
    for (cell, particles) in &cells {
        for around in 0..27 {
            let other = [0, 1, 2].map(|k| cell[k] + (around / 3_i32.pow(k as u32)) % 3 - 1);
            let Some(others) = cells.get(&other) else { continue };
            for (&a, &b) in particles.iter().flat_map(|a| others.iter().map(move |b| (a, b))) {
                if a < b && near(&state.positions, a, b) && !near(rest, a, b) && !model.joins(a, b)
                {
                    touching[a as usize] = true;
                    touching[b as usize] = true;
                }
            }
        }
    }
}

/// Signed distances as in NUMERICS §7, in the local frame.
fn signed_distance(shape: &ColliderShape, point: DVec3, time: f64) -> f64 {
    match *shape {
        ColliderShape::Plane => point.z,
        ColliderShape::Sphere { radius } => point.length() - radius,
        ColliderShape::Capsule { half_length, radius } => {
            let along = point.z.clamp(-half_length, half_length);
            (point - along * DVec3::Z).length() - radius
        }
        ColliderShape::Box { half_extents } => {
            let outside = point.abs() - DVec3::from(half_extents);
            outside.max(DVec3::ZERO).length() + outside.max_element().min(0.0)
        }
        ColliderShape::Grid(ref grid) => grid.distance_at(point.to_array(), time),
        // It has no inside.
        ColliderShape::Surface(_) => f64::INFINITY,
    }
}

/// The edges of all cells that hold a particle; cells are larger where there would be too many.
pub(super) fn bin_lines(positions: &[[f64; 3]], side: f64) -> Vec<PlaceLine> {
    let mut side = side.max(1e-6);
    let mut found = cells(positions, side);
    while found.len() > CELL_LIMIT {
        side *= 2.0;
        found = cells(positions, side);
    }
    let mut lines = Vec::with_capacity(12 * found.len());
    for cell in found.keys() {
        let corner = |bits: usize| {
            let step = |k: usize| (bits >> k & 1) as f64;
            [0, 1, 2].map(|k| (f64::from(cell[k]) + step(k)) * side)
        };
        for start in 0..8_usize {
            for axis in 0..3 {
                if start >> axis & 1 == 0 {
                    let ends = [corner(start), corner(start | 1 << axis)].map(LineEnd::Place);
                    lines.push(PlaceLine { ends, colour: CELL });
                }
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_shapes() {
        let point = DVec3::new(0.0, 3.0, 6.0);
        for (shape, expected) in [
            (ColliderShape::Plane, 6.0),
            (ColliderShape::Sphere { radius: 1.0 }, 45_f64.sqrt() - 1.0),
            (ColliderShape::Capsule { half_length: 2.0, radius: 1.0 }, 4.0),
            (ColliderShape::Box { half_extents: [1.0, 3.0, 2.0] }, 4.0),
        ] {
            assert!((signed_distance(&shape, point, 0.0) - expected).abs() < 1e-12, "{shape:?}");
        }
        let inside = DVec3::new(0.5, 0.0, 0.0);
        let cube = ColliderShape::Box { half_extents: [1.0; 3] };
        assert!((signed_distance(&cube, inside, 0.0) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_cell_has_twelve_edges_and_there_are_never_too_many() {
        assert_eq!(bin_lines(&[[0.1; 3], [0.2; 3]], 1.0).len(), 12);
        let many: Vec<[f64; 3]> = (0..30_000).map(|i| [f64::from(i), 0.5, 0.5]).collect();
        assert!(bin_lines(&many, 1.0).len() <= 12 * CELL_LIMIT);
    }
}
