//! What a look at all particles tells that forces and energies do not: cloth in cloth, and springs pushed together.

use crate::{FabricAudit, Model, SelfContact};

/// How cloth lies in one state (NUMERICS §10). It is computed from positions, alike for all backends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Audit {
    /// Pairs of particles closer than half the contact distance, less those that a spring joins and those that were
    /// closer than the contact distance at the start; 0 without contact of points. Contact holds cloth apart: where
    /// there are such pairs it does not, and one cloth may be in or behind the other.
    pub close_pairs: u64,
    /// Largest relative compression 1 - l/L of the springs whose strain is measured
    /// ([`Springs::strain_measured`](crate::Springs::strain_measured)): edges and diagonals, as a bend spring is
    /// short wherever cloth is folded; 0 if none is compressed.
    pub compression_max: f64,
    /// A particle of that spring.
    pub compression_particle: u32,
    /// Energies and strains of fabric, if there is any.
    pub fabric: Option<FabricAudit>,
}

/// Bits of a cell's number along each axis.
const CELL_BITS: u32 = 21;
/// Largest number of a cell along an axis; what is farther away counts as there, which only makes more to compare.
const CELL_MAX: f64 = ((1_u32 << CELL_BITS) - 2) as f64;

impl Audit {
    /// Looks at `positions` \[m\], one for each particle of `model`.
    #[must_use]
    pub fn new(model: &Model, positions: &[[f64; 3]]) -> Self {
        let of_points = model.self_contact().filter(|contact| !contact.is_of_triangles());
        let close_pairs = of_points.map_or(0, |contact| {
            let reach = 0.5 * contact.distance;
            close_pairs(positions, reach, |i, j| is_apart(model, contact, [i, j]))
        });
        let (compression_max, compression_particle) = compression(model, positions);
        let fabric = FabricAudit::new(model, positions);
        Self { close_pairs, compression_max, compression_particle, fabric }
    }
}

/// Whether contact is to hold two particles apart.
fn is_apart(model: &Model, contact: &SelfContact, [i, j]: [u32; 2]) -> bool {
    let start = [i, j].map(|particle| model.positions()[particle as usize]);
    !model.joins(i, j) && distance(start[0], start[1]) >= contact.distance
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}

/// The largest 1 - l/L of an edge or diagonal and a particle of that spring.
fn compression(model: &Model, positions: &[[f64; 3]]) -> (f64, u32) {
    let mut largest = (0.0, 0);
    let is_measured = model.springs().strain_measured();
    for spring in model.springs().iter().filter(|spring| is_measured[spring.kind as usize]) {
        let [i, j] = spring.particles;
        let rest_length = model.springs().kinds()[spring.kind as usize].rest_length;
        let length = distance(positions[i as usize], positions[j as usize]);
        let compression = 1.0 - length / rest_length;
        if compression > largest.0 {
            largest = (compression, i);
        }
    }
    largest
}

/// Number of pairs closer than `reach` \[m\] that are `counted`. Particles are sorted by cells as long as `reach`: partners
/// of one are in its own cell and the 26 around it. Of these the ones behind it in the order are the next along z,
/// and four rows of three, each of which moves on with the particle.
fn close_pairs(positions: &[[f64; 3]], reach: f64, counted: impl Fn(u32, u32) -> bool) -> u64 {
    let mut low = [f64::INFINITY; 3];
    for position in positions {
        for axis in 0..3 {
            low[axis] = low[axis].min(position[axis]);
        }
    }
    let cell = |position: &[f64; 3]| -> [u64; 3] {
        // One more than it is, so that every cell has neighbours.
        std::array::from_fn(|k| {
            (((position[k] - low[k]) / reach).clamp(0.0, CELL_MAX - 1.0)) as u64 + 1
        })
    };
    let key = |[x, y, z]: [u64; 3]| (x << (2 * CELL_BITS)) | (y << CELL_BITS) | z;
    let mut sorted: Vec<(u64, u32)> =
        positions.iter().zip(0..).map(|(position, i)| (key(cell(position)), i)).collect();
    sorted.sort_unstable();
    let near = |i: u32, j: u32| {
        distance(positions[i as usize], positions[j as usize]) < reach
            && counted(i.min(j), i.max(j))
    };
    let mut pairs = 0;
    let mut starts = [0; 4];
    for (place, &(own, i)) in sorted.iter().enumerate() {
        let column = sorted[place + 1..].iter().take_while(|(other, _)| *other <= own + 1);
        pairs += column.filter(|(_, j)| near(i, *j)).count() as u64;
        for (start, (x, y)) in starts.iter_mut().zip([(0, 1), (1, -1), (1, 0), (1, 1)]) {
            let middle = own.wrapping_add_signed((x << (2 * CELL_BITS)) + (y << CELL_BITS));
            *start += sorted[*start..].iter().take_while(|(other, _)| *other < middle - 1).count();
            let row = sorted[*start..].iter().take_while(|(other, _)| *other <= middle + 1);
            pairs += row.filter(|(_, j)| near(i, *j)).count() as u64;
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, ContactResponse, Geometry, GridPatch, MaterialPreset, ModelBuilder};

    /// Every pair, one by one.
    fn plain(positions: &[[f64; 3]], reach: f64) -> u64 {
        let count = positions.len();
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        pairs.filter(|&(i, j)| distance(positions[i], positions[j]) < reach).count() as u64
    }

    #[test]
    fn close_pairs_are_those_of_all_pairs() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / f64::from(1 << 24)
        };
        let positions: Vec<[f64; 3]> =
            (0..400).map(|_| [random() - 5.0, 0.3 * random(), 0.7 * random()]).collect();
        for reach in [0.01, 0.05, 0.2, 3.0] {
            assert_eq!(close_pairs(&positions, reach, |_, _| true), plain(&positions, reach));
        }
        assert!(plain(&positions, 0.05) > 10);
        let odd = |i: u32, j: u32| (i + j) % 2 == 1 && i < j;
        assert!(close_pairs(&positions, 0.2, odd) < plain(&positions, 0.2));
        let far = [[0.0; 3], [1e9, 0.0, 0.0], [1e9, 0.0, 0.001]];
        assert_eq!(close_pairs(&far, 0.01, |_, _| true), 1, "cells have no end");
        assert_eq!(close_pairs(&[[f64::NAN; 3]; 2], 0.01, |_, _| true), 0);
    }

    /// `stack` ended with two cloths in one plane and said that nothing was wrong.
    #[test]
    fn two_cloths_in_one_plane_are_seen() {
        let spacing = 0.02;
        let patch = |name: &str, height| Cloth {
            name: name.into(),
            geometry: Geometry::Grid(GridPatch::horizontal(6, spacing, height)),
            material: MaterialPreset::ALL[0].material(spacing).into(),
            pins: vec![],
            velocity: [0.0; 3],
        };
        let response = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
        let contact = SelfContact { distance: 0.018, response };
        let builder = ModelBuilder::new().cloth(patch("low", 0.0)).cloth(patch("high", 0.05));
        let model = builder.self_contact(contact).build().unwrap();
        let mut positions = model.positions().to_vec();
        let start = Audit::new(&model, &positions);
        assert_eq!(start.close_pairs, 0);
        assert!(start.compression_max < 1e-12, "{start:?}");
        for position in &mut positions[36..] {
            position[2] = 0.001;
        }
        // A spring of the lower one is pushed together, which is no contact of two cloths.
        positions[0][0] = positions[1][0] - 0.1 * spacing;
        let audit = Audit::new(&model, &positions);
        // A fold brings the ends of a bend spring together, and compresses nothing.
        let mut folded = model.positions().to_vec();
        folded[0] = folded[2];
        folded[0][2] += 0.1 * spacing;
        assert!(Audit::new(&model, &folded).compression_max < 0.5, "a bend spring counts");
        // All but the first lie on their twins; that one has come to the twin of its neighbour.
        assert_eq!(audit.close_pairs, 36);
        assert!((audit.compression_max - 0.9).abs() < 1e-9, "{audit:?}");
        assert_eq!(audit.compression_particle, 0);
    }
}
