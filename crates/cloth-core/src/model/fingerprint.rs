//! Telling models apart.

use std::hash::Hasher;

use fnv::FnvHasher;

use super::{ColliderShape, FabricTriangle, Model};

impl Model {
    /// A hash of what fixes the meaning of a [`State`](crate::State): particles, masses, triangles,
    /// springs and colliders. The same on every machine; a checkpoint carries it, so that it is not
    /// continued with another model.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = FnvHasher::default();
        hasher.write_u64(self.positions.len() as u64);
        for position in &self.positions {
            position.iter().for_each(|value| hasher.write_u64(value.to_bits()));
        }
        self.masses.iter().for_each(|mass| hasher.write_u64(mass.to_bits()));
        self.triangles.iter().flatten().for_each(|&vertex| hasher.write_u32(vertex));
        for spring in self.springs.iter() {
            spring.particles.iter().for_each(|&particle| hasher.write_u32(particle));
            hasher.write_u32(spring.kind);
        }
        for kind in self.springs.kinds() {
            for value in [kind.rest_length, kind.stiffness, kind.damping] {
                hasher.write_u64(value.to_bits());
            }
            // A model without rigidity keeps the hash that it had before there was such a thing.
            if let Some(rigidity) = kind.rigidity {
                hasher.write_u64(rigidity.to_bits());
            }
        }
        // A model of springs keeps the hash that it had before there was fabric.
        for triangle in self.elements.triangles() {
            let FabricTriangle { particles, fabric, rest, angles, bending, fold_weights: _ } =
                triangle;
            particles.iter().for_each(|&particle| hasher.write_u32(particle));
            hasher.write_u32(*fabric);
            let numbers = rest.inverse.iter().flatten().chain([&rest.area]).chain(angles);
            let numbers = numbers.chain(bending.map.iter().flatten()).chain(&bending.plate);
            numbers.for_each(|x| hasher.write_u64(x.to_bits()));
        }
        for fabric in self.elements.fabrics() {
            fabric.numbers().iter().for_each(|number| hasher.write_u64(number.to_bits()));
        }
        for inflation in &self.inflations {
            let numbers = [inflation.pressure, inflation.rise[0], inflation.rise[1]];
            numbers.iter().for_each(|number| hasher.write_u64(number.to_bits()));
        }
        hasher.write_u64(self.colliders.len() as u64);
        hasher.finish()
    }

    /// A hash of the colliders: their shapes, where they start, friction and restitution. The same on every machine.
    #[must_use]
    pub fn collider_fingerprint(&self) -> u64 {
        let mut hasher = FnvHasher::default();
        for collider in &self.colliders {
            let mut number = |value: f64| hasher.write_u64(value.to_bits());
            collider
                .pose
                .translation
                .iter()
                .chain(&collider.pose.rotation)
                .for_each(|&x| number(x));
            number(collider.friction);
            number(collider.restitution);
            let (kind, values): (u8, Vec<f64>) = match &collider.shape {
                ColliderShape::Plane => (0, vec![]),
                ColliderShape::Sphere { radius } => (1, vec![*radius]),
                ColliderShape::Capsule { half_length, radius } => (2, vec![*half_length, *radius]),
                ColliderShape::Box { half_extents } => (3, half_extents.to_vec()),
                ColliderShape::Grid(grid) => {
                    let [x, y, z] = grid.origin;
                    let mut values = vec![x, y, z, grid.spacing, grid.rate];
                    // Checkpoints of solids that do not wait stay good.
                    values.extend((grid.start != 0.0).then_some(grid.start));
                    (4, values)
                }
                ColliderShape::Surface(surface) => (5, vec![surface.rate, surface.start]),
            };
            hasher.write_u8(kind);
            values.iter().for_each(|value| hasher.write_u64(value.to_bits()));
            if let ColliderShape::Surface(surface) = &collider.shape {
                surface.triangles.iter().flatten().for_each(|&vertex| hasher.write_u32(vertex));
                hasher.write_u64(surface.sets.len() as u64);
                let numbers = surface.sets.iter().flatten().flatten();
                numbers.for_each(|number| hasher.write_u64(number.to_bits()));
            }
            if let ColliderShape::Grid(grid) = &collider.shape {
                grid.size.iter().for_each(|&side| hasher.write_u32(side));
                hasher.write_u64(grid.distances.len() as u64);
                grid.distances.iter().for_each(|distance| hasher.write_u32(distance.to_bits()));
            }
        }
        hasher.finish()
    }
}
