//! The springs of a model in the form that the CPU reads them.
//!
//! Particles go in packets of [`LANES`]. A packet has a list of columns; a column gives each
//! particle of the packet at most one spring, and the columns of a particle visit its neighbours in
//! ascending order. Where the neighbours of all particles in a packet lie at the same distance in
//! memory and the springs are alike, as inside a grid, the column is an offset: its loads are
//! contiguous and need no indices. Packets with equal columns share them, so that a regular patch
//! of any size needs a few kilobytes. Everything else is a column of indices.

use std::{collections::HashMap, ops::Range};

use cloth_core::{Buckling, Real, SpringKind, SpringRows, Springs};

use crate::{
    elasticity::BucklingLanes,
    memory::{LANES, Lanes, packets},
};

/// One spring, or none, for each particle of a packet.
#[derive(Clone, Debug)]
pub(crate) struct Column<T> {
    pub(crate) neighbours: Neighbours,
    /// 1 where there is a spring, 0 elsewhere; there stiffness and damping are 0 too.
    pub(crate) active: Lanes<T>,
    pub(crate) rest_length: Lanes<T>,
    pub(crate) stiffness: Lanes<T>,
    pub(crate) damping: Lanes<T>,
    /// 1 where the strain of the spring is measured (NUMERICS §10), 0 elsewhere.
    pub(crate) measured: Lanes<T>,
    /// Only where a spring of the column can buckle.
    pub(crate) buckling: Option<Box<BucklingLanes<T>>>,
}

/// Where the neighbours of a column are.
#[derive(Clone, Debug)]
pub(crate) enum Neighbours {
    /// Neighbour of particle i is i + offset.
    Offset(i32),
    /// The neighbour of each particle; itself where there is no spring.
    Indices(Lanes<u32>),
}

/// All springs, by packets.
#[derive(Clone, Debug)]
pub(crate) struct SpringColumns<T> {
    columns: Vec<Column<T>>,
    packets: Vec<Range<u32>>,
    margin: usize,
    can_buckle: bool,
}

/// A kind of springs in the precision of the solver.
struct Kind<T> {
    rest_length: T,
    stiffness: T,
    damping: T,
    measured: T,
    buckling: Option<Buckling<T>>,
}

impl<T: Real> Kind<T> {
    fn new((kind, is_measured): (&SpringKind, bool)) -> Self {
        Self {
            rest_length: T::from_f64(kind.rest_length),
            stiffness: T::from_f64(kind.stiffness),
            damping: T::from_f64(kind.damping),
            measured: if is_measured { T::ONE } else { T::ZERO },
            buckling: kind.buckling().as_ref().map(Buckling::rounded),
        }
    }
}

/// One entry of the rows of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
struct Entry {
    offset: i64,
    lane: usize,
    kind: u32,
}

impl<T: Real> SpringColumns<T> {
    pub(crate) fn new(springs: &Springs, particle_count: usize) -> Self {
        let rows = springs.gather_rows();
        let kinds: Vec<Kind<T>> =
            springs.kinds().iter().zip(springs.strain_measured()).map(Kind::new).collect();
        let can_buckle = kinds.iter().any(|kind| kind.buckling.is_some());
        let mut result = Self { columns: Vec::new(), packets: Vec::new(), margin: 0, can_buckle };
        let mut shared: HashMap<Vec<Entry>, Range<u32>> = HashMap::new();
        for packet in 0..packets(particle_count) {
            let entries = packet_entries(&rows, packet, particle_count);
            let range = if is_regular(&entries) {
                if let Some(range) = shared.get(&entries) {
                    range.clone()
                } else {
                    let range = result.push_offsets(&kinds, &entries);
                    shared.insert(entries, range.clone());
                    range
                }
            } else {
                result.push_indices(&kinds, packet, &entries)
            };
            result.packets.push(range);
        }
        result.columns.shrink_to_fit();
        result
    }

    /// Entries that arrays need beyond both ends for the loads of offset columns.
    pub(crate) const fn margin(&self) -> usize {
        self.margin
    }

    /// Whether any spring can buckle.
    #[inline(always)]
    pub(crate) const fn can_buckle(&self) -> bool {
        self.can_buckle
    }

    /// The columns of a packet.
    #[inline(always)]
    pub(crate) fn packet(&self, packet: usize) -> &[Column<T>] {
        let range = &self.packets[packet];
        &self.columns[range.start as usize..range.end as usize]
    }

    /// All columns.
    pub(crate) fn columns(&self) -> &[Column<T>] {
        &self.columns
    }

    /// Place of the first column of a packet among all.
    pub(crate) fn packet_start(&self, packet: usize) -> u32 {
        self.packets[packet].start
    }

    /// Number of packets.
    pub(crate) fn packet_count(&self) -> usize {
        self.packets.len()
    }

    fn push_offsets(&mut self, kinds: &[Kind<T>], entries: &[Entry]) -> Range<u32> {
        let start = self.columns.len() as u32;
        for group in entries.chunk_by(|a, b| a.offset == b.offset) {
            let offset = group[0].offset;
            self.margin = self.margin.max(offset.unsigned_abs() as usize + LANES);
            let mut column = Column::empty(Neighbours::Offset(offset as i32));
            for entry in group {
                column.set(kinds, entry);
            }
            self.columns.push(column);
        }
        start..self.columns.len() as u32
    }

    fn push_indices(&mut self, kinds: &[Kind<T>], packet: usize, entries: &[Entry]) -> Range<u32> {
        let start = self.columns.len() as u32;
        let own: Lanes<u32> = std::array::from_fn(|lane| (packet * LANES + lane) as u32);
        let mut used = [0_usize; LANES];
        // Sorted by offset, the entries of each lane come in ascending order of the neighbour.
        for entry in entries {
            let place = start as usize + used[entry.lane];
            used[entry.lane] += 1;
            if place == self.columns.len() {
                self.columns.push(Column::empty(Neighbours::Indices(own)));
            }
            let column = &mut self.columns[place];
            column.set(kinds, entry);
            if let Neighbours::Indices(indices) = &mut column.neighbours {
                indices[entry.lane] = (i64::from(own[entry.lane]) + entry.offset) as u32;
            }
        }
        start..self.columns.len() as u32
    }
}

impl<T: Real> Column<T> {
    fn empty(neighbours: Neighbours) -> Self {
        Self {
            neighbours,
            active: [T::ZERO; LANES],
            rest_length: [T::ONE; LANES],
            stiffness: [T::ZERO; LANES],
            damping: [T::ZERO; LANES],
            measured: [T::ZERO; LANES],
            buckling: None,
        }
    }

    fn set(&mut self, kinds: &[Kind<T>], entry: &Entry) {
        let kind = &kinds[entry.kind as usize];
        self.active[entry.lane] = T::ONE;
        self.rest_length[entry.lane] = kind.rest_length;
        self.stiffness[entry.lane] = kind.stiffness;
        self.damping[entry.lane] = kind.damping;
        self.measured[entry.lane] = kind.measured;
        if let Some(buckling) = kind.buckling {
            let lanes = self.buckling.get_or_insert_with(|| Box::new(BucklingLanes::never()));
            lanes.set(entry.lane, buckling);
        }
    }
}

fn packet_entries(rows: &SpringRows, packet: usize, particle_count: usize) -> Vec<Entry> {
    let mut entries = Vec::new();
    for lane in 0..LANES {
        let i = packet * LANES + lane;
        if i >= particle_count {
            break;
        }
        for e in rows.offsets[i] as usize..rows.offsets[i + 1] as usize {
            let offset = i64::from(rows.columns[e]) - i as i64;
            entries.push(Entry { offset, lane, kind: rows.kinds[e] });
        }
    }
    entries.sort_unstable();
    entries
}

/// Whether offset columns pay: springs at the same offset are alike, and there are at most one and
/// a half times as many offsets as springs at the best connected particle, so that few lanes idle.
fn is_regular(entries: &[Entry]) -> bool {
    let mut degree = [0_usize; LANES];
    let mut offsets = 0;
    for group in entries.chunk_by(|a, b| a.offset == b.offset) {
        let alike = group.iter().all(|entry| entry.kind == group[0].kind);
        if !alike || i32::try_from(group[0].offset).is_err() {
            return false;
        }
        group.iter().for_each(|entry| degree[entry.lane] += 1);
        offsets += 1;
    }
    let largest = degree.into_iter().max().unwrap_or(0);
    2 * offsets <= 3 * largest
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, Geometry, GridPatch, MaterialPreset, Model, ModelBuilder, Stencil, TriangleMesh,
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

    /// All springs of the columns, read back as (particle, neighbour, rest length).
    fn entries(columns: &SpringColumns<f64>, particle_count: usize) -> Vec<(usize, usize, u64)> {
        let mut entries = Vec::new();
        for packet in 0..packets(particle_count) {
            for lane in 0..LANES {
                for column in columns.packet(packet) {
                    if column.active[lane] == 0.0 {
                        assert_eq!([column.stiffness[lane], column.damping[lane]], [0.0; 2]);
                        continue;
                    }
                    let particle = packet * LANES + lane;
                    let neighbour = match &column.neighbours {
                        Neighbours::Offset(offset) => {
                            particle.checked_add_signed(*offset as isize).unwrap()
                        }
                        Neighbours::Indices(indices) => indices[lane] as usize,
                    };
                    entries.push((particle, neighbour, column.rest_length[lane].to_bits()));
                }
            }
        }
        entries
    }

    /// The same from the model; in the same order only if columns visit neighbours ascending.
    fn expected(model: &Model) -> Vec<(usize, usize, u64)> {
        let rows = model.springs().gather_rows();
        (0..model.particle_count())
            .flat_map(|i| {
                (rows.offsets[i] as usize..rows.offsets[i + 1] as usize).map(move |e| (i, e))
            })
            .map(|(i, e)| {
                let kind = &model.springs().kinds()[rows.kinds[e] as usize];
                (i, rows.columns[e] as usize, kind.rest_length.to_bits())
            })
            .collect()
    }

    #[test]
    fn a_grid_needs_few_columns_and_loses_no_spring() {
        for (columns, rows, stencil) in [
            (160, 40, Stencil::Neighbours12),
            (37, 23, Stencil::Neighbours24),
            (2, 3, Stencil::Neighbours12),
        ] {
            let model = grid(columns, rows, stencil);
            let packed = SpringColumns::<f64>::new(model.springs(), model.particle_count());
            assert_eq!(entries(&packed, model.particle_count()), expected(&model));
        }
        // The patterns of 160 columns repeat with the rows: a taller patch needs no more of them.
        let columns = |rows| {
            let model = grid(160, rows, Stencil::Neighbours12);
            SpringColumns::<f64>::new(model.springs(), model.particle_count()).columns.len()
        };
        assert_eq!(columns(40), columns(80));
    }

    #[test]
    fn a_mesh_without_order_loses_no_spring() {
        // A fan: the hub is joined to everything, no two rows are alike.
        let rim = 50_u32;
        let mesh = TriangleMesh {
            positions: std::iter::once([0.0; 3])
                .chain((0..rim).map(|i| {
                    let angle = f64::from(i) * std::f64::consts::TAU / f64::from(rim);
                    [angle.cos(), 1.1 * angle.sin(), 0.0]
                }))
                .collect(),
            triangles: (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect(),
            ..TriangleMesh::default()
        };
        let model = model(Geometry::Mesh(mesh));
        let packed = SpringColumns::<f64>::new(model.springs(), model.particle_count());
        assert_eq!(entries(&packed, model.particle_count()), expected(&model));
    }
}
