//! What serves one regular grid alone: a patch in tiles, and the sizes of its forms. Their kernels are in `kernels/cuda/patch`;
//! the table of forms (`forms.rs`) is the one way to them.

use cloth_core::{Model, NONE, RegularPatch};

/// Numbers of the springs of a tile, as in `stencil.cuh`.
pub(crate) const STENCIL_FORCES: usize = 53 * 37 * 3;
/// Particles along both sides of a tile of the frame kernel.
const TILE: [usize; 2] = [32, 8];
/// Particles along both sides of a group of a warp.
const GROUP_SIDES: [usize; 2] = [8, 4];
/// A regular patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Patch {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Patch {
    /// The patch that a model is, if it is one.
    pub(crate) fn of(model: &Model) -> Option<Self> {
        let RegularPatch { columns, rows } = RegularPatch::of(model)?;
        Some(Self { columns, rows })
    }

    /// The kinds of the springs to the later of 12 neighbours, as [`RegularPatch::stencil`] has them.
    pub(crate) fn stencil(&self, model: &Model) -> Option<[u32; 6]> {
        RegularPatch { columns: self.columns, rows: self.rows }.stencil(model)
    }

    /// Tiles along the columns.
    pub(crate) const fn tiles_across(&self) -> usize {
        self.columns.div_ceil(TILE[0])
    }

    /// All tiles.
    pub(crate) const fn tiles(&self) -> usize {
        self.tiles_across() * self.rows.div_ceil(TILE[1])
    }

    /// The particles in groups of a warp: the parts of the tiles, 8 by 4, as the frame kernel takes them; [`NONE`] beyond
    /// the edges.
    pub(crate) fn groups(&self) -> Vec<u32> {
        let [across, down] = [TILE[0] / GROUP_SIDES[0], TILE[1] / GROUP_SIDES[1]];
        let mut members = Vec::with_capacity(self.tiles() * TILE[0] * TILE[1]);
        for tile in 0..self.tiles() {
            let origin =
                [tile % self.tiles_across() * TILE[0], tile / self.tiles_across() * TILE[1]];
            for part in 0..across * down {
                let [left, top] = [part % across * GROUP_SIDES[0], part / across * GROUP_SIDES[1]];
                for lane in 0..GROUP_SIDES[0] * GROUP_SIDES[1] {
                    let column = origin[0] + left + lane % GROUP_SIDES[0];
                    let row = origin[1] + top + lane / GROUP_SIDES[0];
                    let exists = column < self.columns && row < self.rows;
                    members.push(if exists { (row * self.columns + column) as u32 } else { NONE });
                }
            }
        }
        members
    }

    /// The tile of a particle.
    pub(crate) const fn tile_of(&self, particle: usize) -> usize {
        let (column, row) = (particle % self.columns, particle / self.columns);
        row / TILE[1] * self.tiles_across() + column / TILE[0]
    }

    /// The same if tiles are counted down each strip, as in `explicit_substep_flat.cu`.
    pub(crate) const fn tile_in_strips(&self, particle: usize) -> usize {
        let (column, row) = (particle % self.columns, particle / self.columns);
        column / TILE[0] * self.rows.div_ceil(TILE[1]) + row / TILE[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_parts_of_tiles() {
        let patch = Patch { columns: 70, rows: 17 };
        let groups = patch.groups();
        assert_eq!(groups.len(), patch.tiles() * 256);
        let mut present: Vec<u32> = groups.iter().copied().filter(|&p| p != NONE).collect();
        assert_eq!(groups[32..42], [8, 9, 10, 11, 12, 13, 14, 15, 78, 79]);
        assert!(groups.iter().enumerate().all(|(place, &particle)| {
            particle == NONE || patch.tile_of(particle as usize) == place / 256
        }));
        present.sort_unstable();
        assert!(present.into_iter().eq(0..70 * 17));
    }

    #[test]
    fn tiles_cover_the_patch() {
        let patch = Patch { columns: 70, rows: 17 };
        assert_eq!((patch.tiles_across(), patch.tiles()), (3, 9));
        let particles = [0, 31, 32, 69, 7 * 70, 8 * 70];
        assert_eq!(particles.map(|i| patch.tile_of(i)), [0, 0, 1, 2, 0, 3]);
        assert_eq!(particles.map(|i| patch.tile_in_strips(i)), [0, 0, 3, 6, 0, 1]);
    }
}
