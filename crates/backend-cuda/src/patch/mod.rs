//! What serves one regular grid alone: a patch in tiles, and the sizes of its forms. Their kernels are in `kernels/cuda/patch`;
//! the table of forms (`forms.rs`) is the one way to them.

mod contact;

use cloth_core::{Model, NONE, RegularPatch};

pub(crate) use contact::{
    CONTACT_GROUPS, CONTACT_PARTICLES_MAX, CONTACT_STATIC, STENCIL_FORCES, contact_shared_bytes,
};

use crate::tables::SpringTables;

/// Particles along both sides of a tile of the frame kernel.
const TILE: [usize; 2] = [32, 8];
/// Particles along both sides of a group of a warp.
const GROUP_SIDES: [usize; 2] = [8, 4];
/// How far springs may reach.
const HALO: i64 = 2;

/// Rows and columns to the later of 24 neighbours, in the order of their offsets, as in `patch/neighbours24.cuh`.
const NEIGHBOURS: [[i64; 2]; 12] = [
    [0, 1],
    [0, 2],
    [1, -2],
    [1, -1],
    [1, 0],
    [1, 1],
    [1, 2],
    [2, -2],
    [2, -1],
    [2, 0],
    [2, 1],
    [2, 2],
];

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

    /// The kinds of the springs to the later of 24 neighbours, in the order of the slots, if every particle has those that are
    /// within the patch, and those in one direction are of one kind.
    pub(crate) fn neighbours<T>(&self, tables: &SpringTables<T>) -> Option<[u32; 12]> {
        if !tables.is_regular || tables.slot_count as usize != NEIGHBOURS.len() {
            return None;
        }
        // By what is within reach on each of the four sides, the row that particles have, once it has been looked at.
        let mut rows = [None; 256];
        let mut kinds = [None; NEIGHBOURS.len()];
        for (particle, &number) in tables.rows.iter().enumerate() {
            let [row, column] = [particle / self.columns, particle % self.columns];
            let sides = [row, self.rows - 1 - row, column, self.columns - 1 - column]
                .map(|side| side.min(HALO as usize));
            let place = sides.iter().fold(0, |place, side| place << 2 | side);
            match rows[place] {
                Some(found) if found == number => {}
                Some(_) => return None,
                None => {
                    self.row_check(tables, number, sides, &mut kinds)?;
                    rows[place] = Some(number);
                }
            }
        }
        kinds.iter().all(Option::is_some).then(|| kinds.map(Option::unwrap_or_default))
    }

    /// Whether a row has all neighbours that are within reach on its four sides and no other; takes note of their kinds.
    fn row_check<T>(
        &self,
        tables: &SpringTables<T>,
        number: u32,
        [above, below, left, right]: [usize; 4],
        kinds: &mut [Option<u32>; NEIGHBOURS.len()],
    ) -> Option<()> {
        let [first, count] = tables.headers[number as usize].map(|part| part as usize);
        let mut entries =
            tables.entries.get(first..first + count)?.iter().zip(&tables.slots[first..]);
        for rows in -(above as i64)..=below as i64 {
            for columns in -(left as i64)..=right as i64 {
                if [rows, columns] == [0, 0] {
                    continue;
                }
                let (&[offset, kind], &slot) = entries.next()?;
                let later =
                    if [rows, columns] > [0, 0] { [rows, columns] } else { [-rows, -columns] };
                let expected = NEIGHBOURS.iter().position(|&neighbour| neighbour == later)?;
                let is_there = i64::from(offset as i32) == rows * self.columns as i64 + columns
                    && slot as usize == expected
                    && *kinds[expected].get_or_insert(kind) == kind;
                is_there.then_some(())?;
            }
        }
        entries.next().is_none().then_some(())
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

    /// The same if tiles are counted down each strip, as in `explicit_substep_tiles.cu`.
    pub(crate) const fn tile_in_strips(&self, particle: usize) -> usize {
        let (column, row) = (particle % self.columns, particle / self.columns);
        column / TILE[0] * self.rows.div_ceil(TILE[1]) + row / TILE[1]
    }
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
                material: MaterialPreset::ALL[0].material(0.02).into(),
                pins: vec![],
                velocity: [0.0; 3],
            });
        }
        builder.build().unwrap()
    }

    #[test]
    fn a_patch_of_24_neighbours_has_a_kind_for_each_direction() {
        let find = |model: &Model| {
            let tables = SpringTables::<f32>::new(model, true);
            Patch::of(model).and_then(|patch| patch.neighbours(&tables))
        };
        for [columns, rows] in [[40, 30], [7, 19], [33, 8]] {
            let model = model(&[[columns, rows]], Stencil::Neighbours24);
            let lengths = find(&model).unwrap().map(|kind| {
                (model.springs().kinds()[kind as usize].rest_length / 0.02).powi(2).round() as u32
            });
            assert_eq!(lengths, [1, 4, 5, 2, 1, 2, 5, 8, 5, 4, 5, 8]);
        }
        assert_eq!(find(&model(&[[40, 30]], Stencil::Neighbours12)), None);
        // The last row of one cloth is not joined to the first of the next.
        assert_eq!(find(&model(&[[40, 30], [40, 20]], Stencil::Neighbours24)), None);
    }

    #[test]
    fn a_patch_with_one_spring_of_another_kind_is_none_of_24_neighbours() {
        let model = model(&[[40, 30]], Stencil::Neighbours24);
        let patch = Patch::of(&model).unwrap();
        let mut tables = SpringTables::<f32>::new(&model, true);
        let inside = tables.rows[20 * 40 + 20];
        let [first, _] = tables.headers[inside as usize];
        tables.entries[first as usize + 5][1] ^= 1;
        assert_eq!(patch.neighbours(&tables), None);
    }

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
