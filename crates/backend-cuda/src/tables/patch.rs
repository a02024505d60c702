//! Whether a model is one regular patch, whose springs join particles at most two apart along both sides.

use std::collections::BTreeSet;

use cloth_core::Model;

/// Particles along both sides of a tile of the frame kernel.
const TILE: [usize; 2] = [32, 8];
/// How far springs may reach.
const HALO: i64 = 2;

/// A regular patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patch {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Patch {
    /// The patch that a model is, if it is one.
    pub(crate) fn of(model: &Model) -> Option<Self> {
        let n = model.particle_count();
        let springs = model.springs();
        let offsets: BTreeSet<u32> =
            springs.iter().map(|spring| spring.particles[1] - spring.particles[0]).collect();
        let beyond = i64::from(*offsets.iter().find(|&&offset| i64::from(offset) > HALO)?);
        let columns = (beyond - HALO..=beyond + HALO)
            .filter(|columns| *columns > 2 * HALO && n as i64 % columns == 0)
            .find(|&columns| springs.iter().all(|spring| is_near(spring.particles, columns)))?;
        Some(Self { columns: columns as usize, rows: n / columns as usize })
    }

    /// Tiles along the columns.
    pub(crate) const fn tiles_across(&self) -> usize {
        self.columns.div_ceil(TILE[0])
    }

    /// All tiles.
    pub(crate) const fn tiles(&self) -> usize {
        self.tiles_across() * self.rows.div_ceil(TILE[1])
    }

    /// The tile of a particle.
    pub(crate) const fn tile_of(&self, particle: usize) -> usize {
        let (column, row) = (particle % self.columns, particle / self.columns);
        row / TILE[1] * self.tiles_across() + column / TILE[0]
    }
}

/// Whether two particles are near each other along both sides.
fn is_near(particles: [u32; 2], columns: i64) -> bool {
    let [a, b] = particles.map(i64::from);
    (a % columns - b % columns).abs() <= HALO && (a / columns - b / columns).abs() <= HALO
}

#[cfg(test)]
mod tests {
    use cloth_core::{Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, Stencil};

    use super::*;

    fn model(patches: &[[u32; 2]], stencil: Stencil) -> Model {
        let mut builder = ModelBuilder::new();
        for (number, &[columns, rows]) in patches.iter().enumerate() {
            let patch = GridPatch { columns, rows, stencil, ..GridPatch::horizontal(2, 0.02, 0.0) };
            builder = builder.cloth(Cloth {
                name: number.to_string(),
                geometry: Geometry::Grid(patch),
                material: MaterialPreset::ALL[0].material(0.02),
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
                let found = Patch::of(&model(&[[columns, rows]], stencil));
                let expected = Patch { columns: columns as usize, rows: rows as usize };
                assert_eq!(found, Some(expected));
            }
        }
        assert_eq!(Patch::of(&model(&[[40, 30], [17, 20]], Stencil::Neighbours12)), None);
    }

    #[test]
    fn tiles_cover_the_patch() {
        let patch = Patch { columns: 70, rows: 17 };
        assert_eq!((patch.tiles_across(), patch.tiles()), (3, 9));
        assert_eq!([0, 31, 32, 69, 7 * 70, 8 * 70].map(|i| patch.tile_of(i)), [0, 0, 1, 2, 0, 3]);
    }
}
