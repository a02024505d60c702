//! Whether a model is one regular patch, whose springs join particles at most two apart along both sides.

use std::collections::BTreeSet;

use super::Model;

/// How far springs may reach, in particles along a side.
const REACH: i64 = 2;

/// Rows and columns to the later of the 12 neighbours of a particle.
const STENCIL: [[i64; 2]; 6] = [[0, 1], [0, 2], [1, -1], [1, 0], [1, 1], [2, 0]];

/// A model that is one regular patch, its particles row by row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegularPatch {
    /// Particles of a row.
    pub columns: usize,
    /// Rows.
    pub rows: usize,
}

impl RegularPatch {
    /// The patch that a model is, if it is one, found by its springs.
    #[must_use]
    pub fn of(model: &Model) -> Option<Self> {
        if model.has_fabric() {
            return None;
        }
        let n = model.particle_count();
        let springs = model.springs();
        let offsets: BTreeSet<u32> =
            springs.iter().map(|spring| spring.particles[1] - spring.particles[0]).collect();
        let beyond = i64::from(*offsets.iter().find(|&&offset| i64::from(offset) > REACH)?);
        let columns = (beyond - REACH..=beyond + REACH)
            .filter(|columns| *columns > 2 * REACH && n as i64 % columns == 0)
            .find(|&columns| springs.iter().all(|spring| is_near(spring.particles, columns)))?;
        Some(Self { columns: columns as usize, rows: n / columns as usize })
    }

    /// The kinds of the springs to the later of 12 neighbours, if every particle has those that are within the patch, those
    /// in one direction are of one kind, and none buckles; all cloths are equally thick, and nothing pulls with a negative zero.
    #[must_use]
    pub fn stencil(&self, model: &Model) -> Option<[u32; 6]> {
        // The sum of the forces that a particle starts from must not be a negative zero, which tells the negative of a
        // zero from a zero.
        let acceleration = model.uniform_acceleration();
        if acceleration.iter().any(|&a| a == 0.0 && a.is_sign_negative()) {
            return None;
        }
        // All are given the thickness of the first.
        let mut thicknesses = model.cloths().iter().map(|cloth| cloth.thickness);
        let first = thicknesses.next();
        if thicknesses.any(|thickness| Some(thickness) != first) {
            return None;
        }
        let springs = model.springs();
        let mut kinds = [None; 6];
        let mut counts = [0; 6];
        for spring in springs.iter() {
            let [a, b] = spring.particles.map(|particle| {
                [particle as usize / self.columns, particle as usize % self.columns]
                    .map(|place| place as i64)
            });
            let slot = STENCIL.iter().position(|&offset| offset == [b[0] - a[0], b[1] - a[1]])?;
            if *kinds[slot].get_or_insert(spring.kind) != spring.kind {
                return None;
            }
            counts[slot] += 1;
        }
        let mut found = [0; 6];
        for (slot, [rows, columns]) in STENCIL.into_iter().enumerate() {
            let [rows, columns] = [(self.rows, rows), (self.columns, columns)]
                .map(|(side, offset)| side.saturating_sub(offset.unsigned_abs() as usize));
            found[slot] = kinds[slot]?;
            let buckles = springs.kinds()[found[slot] as usize].buckling().is_some();
            if counts[slot] != rows * columns || buckles {
                return None;
            }
        }
        Some(found)
    }
}

/// Whether two particles are near each other along both sides.
fn is_near(particles: [u32; 2], columns: i64) -> bool {
    let [a, b] = particles.map(i64::from);
    (a % columns - b % columns).abs() <= REACH && (a / columns - b / columns).abs() <= REACH
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, Stencil};

    fn model(patches: &[[u32; 2]], stencil: Stencil) -> Model {
        let mut builder = ModelBuilder::new();
        for (number, &[columns, rows]) in patches.iter().enumerate() {
            let patch = GridPatch { columns, rows, stencil, ..GridPatch::horizontal(2, 0.02, 0.0) };
            builder = builder.cloth(Cloth {
                name: number.to_string(),
                geometry: Geometry::Grid(patch),
                material: MaterialPreset::ALL[0].material(0.02).into(),
                pins: vec![],
                velocity: [0.0; 3],
            });
        }
        builder.build().unwrap()
    }

    #[test]
    fn a_patch_is_recognised_by_its_springs() {
        for stencil in [Stencil::Neighbours12, Stencil::Neighbours24] {
            for [columns, rows] in [[40, 30], [7, 19], [33, 8]] {
                let found = RegularPatch::of(&model(&[[columns, rows]], stencil));
                let expected = RegularPatch { columns: columns as usize, rows: rows as usize };
                assert_eq!(found, Some(expected));
            }
        }
        assert_eq!(RegularPatch::of(&model(&[[40, 30], [17, 20]], Stencil::Neighbours12)), None);
    }

    #[test]
    fn a_patch_of_one_kind_of_cloth_has_a_stencil() {
        let find = |patches: &[[u32; 2]], stencil| {
            let model = model(patches, stencil);
            (RegularPatch::of(&model).and_then(|patch| patch.stencil(&model)), model)
        };
        for [columns, rows] in [[40, 30], [7, 19], [33, 8]] {
            let (found, model) = find(&[[columns, rows]], Stencil::Neighbours12);
            let lengths = found.unwrap().map(|kind| {
                (model.springs().kinds()[kind as usize].rest_length / 0.02).powi(2).round() as u32
            });
            assert_eq!(lengths, [1, 4, 2, 1, 2, 4]);
            assert_eq!(find(&[[columns, rows]], Stencil::Neighbours24).0, None);
        }
        // The last row of one cloth is not joined to the first of the next.
        assert_eq!(find(&[[40, 30], [40, 20]], Stencil::Neighbours12).0, None);
    }
}
