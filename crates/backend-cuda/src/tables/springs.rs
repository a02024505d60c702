//! The springs of a model in the form of `shared/spring.cuh`.
//!
//! Particles whose springs are alike, in offset and kind, share one row: a patch of any size needs a
//! few dozen rows for its inside, edges and corners, which fit into the shared memory of a block. All others
//! have a row of their own, laid out in slices of [`SLICE`] particles with the k-th entries side by side, so
//! that neighbouring threads read neighbouring memory (Monakov, Lokhmotov and Avetisyan 2010,
//! "Automatically tuning sparse matrix-vector multiplication for GPU architectures").

use std::collections::HashMap;

use cloth_core::{Buckling, Model, SpringKind, SpringRows};

use crate::layout::{CudaReal, Real4};

/// Particles of a slice.
const SLICE: usize = 32;
/// log2 of the distance between the entries of a row in a slice.
const SLICE_SHIFT: u32 = SLICE.trailing_zeros();
/// Rows that so many particles have in common are stored once.
const SHARED_MIN: u32 = 4;
/// Distinct offsets to later particles that shared rows may have together.
const OFFSETS_MAX: usize = 32;
/// Kinds of rows that are all shared, whether particles are alike or not.
const ROWS_MAX: usize = 64;
/// Set in a slot that belongs to one spring alone.
const OWN: u32 = 1 << 31;

/// Offset to the other particle and index of the kind.
type Entry = (u32, u32);

/// The tables.
#[derive(Debug)]
pub(crate) struct SpringTables<T> {
    /// For each particle the number of its row.
    pub(crate) rows: Vec<u32>,
    /// For each row first entry, and count with log2 of the stride above bit 24.
    pub(crate) headers: Vec<[u32; 2]>,
    /// Offset and kind.
    pub(crate) entries: Vec<[u32; 2]>,
    /// The same in one word each: the kind above bit 16, the offset below, with its sign. Empty if some do not fit.
    pub(crate) packed: Vec<u32>,
    /// Where the factors of the entry are kept in a linear system: a slot, in which each particle has the
    /// spring to a later one, or, with bit 31, the number of a spring after all slots.
    pub(crate) slots: Vec<u32>,
    pub(crate) slot_count: u32,
    pub(crate) own_count: u32,
    /// Rest length, stiffness, damping, and what the kind is: 1 if it buckles, else 0 if its strain is
    /// measured, -1 if not. What buckles is a bend spring, whose strain is not measured.
    pub(crate) kinds: Vec<Real4<T>>,
    pub(crate) buckling: Vec<[T; 6]>,
    pub(crate) can_buckle: bool,
    /// Whether no particle has a row of its own.
    pub(crate) is_regular: bool,
}

impl<T: CudaReal> SpringTables<T> {
    /// The tables of a model. Without `patches` every particle gets a row of its own.
    pub(crate) fn new(model: &Model, patches: bool) -> Self {
        let rows = model.springs().gather_rows();
        let count = model.particle_count();
        let mut alike: HashMap<Vec<Entry>, u32> = HashMap::new();
        let mut key = Vec::new();
        for particle in 0..count {
            row_of(&rows, particle, &mut key);
            match alike.get_mut(&key) {
                Some(times) => *times += 1,
                None => {
                    alike.insert(key.clone(), 1);
                }
            }
        }
        // A patch has a few kinds of rows, of which those at the corners appear once.
        let few = alike.len() <= ROWS_MAX && 4 * alike.len() <= count;
        alike.retain(|_, times| patches && (few || *times >= SHARED_MIN));
        let mut offsets: Vec<u32> = alike.keys().flatten().map(|entry| entry.0).collect();
        offsets.retain(|&offset| (offset as i32) > 0);
        offsets.sort_unstable();
        offsets.dedup();
        if offsets.len() > OFFSETS_MAX {
            alike.clear();
            offsets.clear();
        }
        let kinds = model.springs().kinds();
        let mut tables = Self {
            rows: Vec::with_capacity(count),
            headers: Vec::new(),
            entries: Vec::new(),
            packed: Vec::new(),
            slots: Vec::new(),
            slot_count: offsets.len() as u32,
            own_count: 0,
            kinds: spring_kinds(model),
            buckling: kinds
                .iter()
                .map(|kind| {
                    let never = Buckling::never();
                    let buckling = kind.buckling().map_or(never, |buckling| buckling.rounded());
                    [
                        buckling.force_scale,
                        buckling.inverse_rest_length,
                        buckling.energy_offset,
                        buckling.stiff_compression,
                        buckling.stiff_energy,
                        T::ZERO,
                    ]
                })
                .collect(),
            can_buckle: kinds.iter().any(|kind| kind.buckling().is_some()),
            is_regular: false,
        };
        let mut shared: HashMap<Vec<Entry>, u32> = HashMap::new();
        let mut own: HashMap<[u32; 2], u32> = HashMap::new();
        let mut alone = Vec::new();
        for particle in 0..count {
            row_of(&rows, particle, &mut key);
            if !alike.contains_key(&key) {
                alone.push((particle, key.clone()));
                tables.rows.push(0);
                continue;
            }
            let number = *shared.entry(key.clone()).or_insert_with(|| {
                tables.headers.push([tables.entries.len() as u32, key.len() as u32]);
                for &(offset, kind) in &key {
                    tables.entries.push([offset, kind]);
                    tables.slots.push(slot(&offsets, offset).unwrap_or(0));
                }
                tables.headers.len() as u32 - 1
            });
            tables.rows.push(number);
        }
        tables.is_regular = alone.is_empty();
        for slice in alone.chunks(SLICE) {
            tables.push_slice(slice, &offsets, &mut own);
        }
        tables.own_count = own.len() as u32;
        tables.packed = tables.entries.iter().map_while(|&entry| packed(entry)).collect();
        if tables.packed.len() < tables.entries.len() {
            tables.packed.clear();
        }
        tables
    }

    fn push_slice(
        &mut self,
        slice: &[(usize, Vec<Entry>)],
        offsets: &[u32],
        own: &mut HashMap<[u32; 2], u32>,
    ) {
        let start = self.entries.len();
        let longest = slice.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
        self.entries.resize(start + longest * SLICE, [0; 2]);
        self.slots.resize(start + longest * SLICE, 0);
        for (lane, (particle, row)) in slice.iter().enumerate() {
            self.rows[*particle] = self.headers.len() as u32;
            self.headers.push([(start + lane) as u32, row.len() as u32 | SLICE_SHIFT << 24]);
            for (k, &(offset, kind)) in row.iter().enumerate() {
                let at = start + k * SLICE + lane;
                self.entries[at] = [offset, kind];
                let (i, j) = (*particle as u32, (*particle as u32).wrapping_add(offset));
                self.slots[at] = slot(offsets, offset).unwrap_or_else(|| {
                    let next = own.len() as u32;
                    OWN | *own.entry([i.min(j), i.max(j)]).or_insert(next)
                });
            }
        }
    }
}

/// An entry in one word, if it fits.
fn packed([offset, kind]: [u32; 2]) -> Option<u32> {
    let offset = i16::try_from(offset as i32).ok()?;
    let kind = u16::try_from(kind).ok()?;
    Some(u32::from(kind) << 16 | u32::from(offset as u16))
}

/// The slot of springs to a particle at this offset, either way.
fn slot(offsets: &[u32], offset: u32) -> Option<u32> {
    let forward = if (offset as i32) > 0 { offset } else { offset.wrapping_neg() };
    offsets.binary_search(&forward).ok().map(|slot| slot as u32)
}

fn row_of(rows: &SpringRows, particle: usize, row: &mut Vec<Entry>) {
    let range = rows.offsets[particle] as usize..rows.offsets[particle + 1] as usize;
    row.clear();
    row.extend(range.map(|at| (rows.columns[at].wrapping_sub(particle as u32), rows.kinds[at])));
}

/// Rest length, stiffness, damping of each kind of springs, and whether it buckles or is measured.
pub(crate) fn spring_kinds<T: CudaReal>(model: &Model) -> Vec<[T; 4]> {
    let all = model.springs().kinds().iter().zip(model.springs().strain_measured());
    let numbers = |(kind, is_measured): (&SpringKind, bool)| {
        let what = match (kind.buckling(), is_measured) {
            (Some(_), _) => 1.0,
            (None, true) => 0.0,
            (None, false) => -1.0,
        };
        [kind.rest_length, kind.stiffness, kind.damping, what].map(T::from_f64)
    };
    all.map(numbers).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use cloth_core::{
        Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, Stencil, TriangleMesh,
    };

    use super::*;

    fn model(geometry: Geometry) -> Model {
        let material = MaterialPreset::ALL[0].material(geometry.spacing());
        let name = "cloth".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        ModelBuilder::new().cloth(cloth).build().unwrap()
    }

    fn grid(columns: u32, rows: u32, stencil: Stencil) -> Model {
        let patch = GridPatch { columns, rows, stencil, ..GridPatch::horizontal(2, 0.02, 0.0) };
        model(Geometry::Grid(patch))
    }

    fn fan() -> Model {
        let rim = 50_u32;
        model(Geometry::Mesh(TriangleMesh {
            positions: std::iter::once([0.0; 3])
                .chain((0..rim).map(|i| {
                    let angle = f64::from(i) * std::f64::consts::TAU / f64::from(rim);
                    [angle.cos(), 1.1 * angle.sin(), 0.0]
                }))
                .collect(),
            triangles: (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect(),
            ..TriangleMesh::default()
        }))
    }

    /// Reads the tables as the kernels do: neighbour, kind, and place of the factors.
    fn read_back(model: &Model, patches: bool) -> Vec<Vec<(usize, u32, usize)>> {
        let tables = SpringTables::<f32>::new(model, patches);
        let count = model.particle_count();
        let row = |particle: usize| {
            let [first, shape] = tables.headers[tables.rows[particle] as usize];
            let stride = 1_usize << (shape >> 24);
            (0..(shape & 0xff_ffff) as usize)
                .map(|k| {
                    let at = first as usize + k * stride;
                    let [offset, kind] = tables.entries[at];
                    let other = (particle as u32).wrapping_add(offset) as usize;
                    let slot = tables.slots[at] as usize;
                    let place = if tables.slots[at] & OWN == 0 {
                        slot * count + particle.min(other)
                    } else {
                        tables.slot_count as usize * count + (slot & !(OWN as usize))
                    };
                    (other, kind, place)
                })
                .collect()
        };
        for (entry, packed) in tables.entries.iter().zip(&tables.packed) {
            assert_eq!([(*packed as i16) as i32 as u32, packed >> 16], *entry);
        }
        assert_eq!(tables.packed.len(), tables.entries.len());
        (0..count).map(row).collect()
    }

    fn check(model: &Model, patches: bool) {
        let rows = model.springs().gather_rows();
        let found = read_back(model, patches);
        let mut places = HashMap::new();
        for (particle, row) in found.iter().enumerate() {
            let range = rows.offsets[particle] as usize..rows.offsets[particle + 1] as usize;
            let expected: Vec<_> =
                range.map(|at| (rows.columns[at] as usize, rows.kinds[at])).collect();
            let without_places: Vec<_> = row.iter().map(|&(j, kind, _)| (j, kind)).collect();
            assert_eq!(without_places, expected);
            for &(j, _, place) in row {
                let pair = (particle.min(j), particle.max(j));
                assert_eq!(*places.entry(pair).or_insert(place), place, "from both ends");
            }
        }
        let distinct: HashSet<_> = places.values().collect();
        assert_eq!(distinct.len(), places.len(), "no two springs share a place");
    }

    #[test]
    fn no_spring_is_lost_and_each_has_a_place() {
        let patches = [
            grid(40, 30, Stencil::Neighbours12),
            grid(17, 9, Stencil::Neighbours24),
            grid(2, 2, Stencil::Neighbours12),
            fan(),
        ];
        for model in &patches {
            check(model, true);
            check(model, false);
        }
    }

    #[test]
    fn patches_of_any_size_share_their_rows() {
        let tables =
            |side| SpringTables::<f32>::new(&grid(side, side, Stencil::Neighbours12), true);
        assert_eq!(tables(40).entries.len(), tables(80).entries.len());
        assert!(tables(40).is_regular && tables(80).is_regular);
        assert!(!SpringTables::<f32>::new(&fan(), true).is_regular);
    }

    #[test]
    fn an_entry_that_is_too_large_is_not_packed() {
        assert_eq!(packed([0_u32.wrapping_sub(1), 7]), Some(7 << 16 | 0xffff));
        assert_eq!(packed([1 << 15, 0]), None);
        assert_eq!(packed([1, 1 << 16]), None);
    }
}
