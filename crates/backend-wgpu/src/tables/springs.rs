//! The springs of a model in the form of `shared/spring.wgsl`.
//!
//! Particles whose springs are alike, in offset and kind, share one row: a patch of any size needs a
//! few dozen rows for its inside, edges and corners. All others have a row of their own, laid out in
//! slices of [`SLICE`] particles with the k-th entries side by side, so that neighbouring threads read
//! neighbouring memory (Monakov, Lokhmotov and Avetisyan 2010, "Automatically tuning sparse matrix-vector
//! multiplication for GPU architectures").

use std::collections::HashMap;

use cloth_core::{Buckling, Model, SpringKind, SpringRows, Springs};

/// Particles of a slice.
const SLICE: usize = 32;
/// log2 of the distance between the entries of a row in a slice.
const SLICE_SHIFT: u32 = SLICE.trailing_zeros();
/// Rows that so many particles have in common are stored once.
const SHARED_MIN: u32 = 4;

/// Offset to the other particle and index of the kind.
type Entry = (u32, u32);

/// Words of four numbers that a spring takes where some may buckle (`shared/spring_buckling.wgsl`).
const BUCKLING_WORDS: usize = 3;

/// Force scale of a spring that never buckles. In the reference it is infinite, which WGSL does not know; this
/// is a compressive force that no spring of finite stiffness exceeds.
const NEVER_FORCE_SCALE: f32 = 1e37;

/// Whether some spring of a model buckles.
pub(crate) fn may_buckle(model: &Model) -> bool {
    model.springs().kinds().iter().any(|kind| kind.rigidity.is_some())
}

/// Contents of `spring_rows` and `spring_entries`.
pub(super) fn tables(model: &Model) -> (Vec<u32>, Vec<[u32; 4]>) {
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
    let mut table = Builder {
        springs: model.springs(),
        words: if may_buckle(model) { BUCKLING_WORDS } else { 1 },
        row_numbers: Vec::with_capacity(count),
        headers: Vec::new(),
        entries: Vec::new(),
        shared: HashMap::new(),
    };
    let mut alone = Vec::new();
    for particle in 0..count {
        row_of(&rows, particle, &mut key);
        if alike[&key] >= SHARED_MIN {
            table.push_shared(&key);
        } else {
            alone.push((particle, key.clone()));
            table.row_numbers.push(0);
        }
    }
    for slice in alone.chunks(SLICE) {
        table.push_slice(slice);
    }
    table.finish()
}

fn row_of(rows: &SpringRows, particle: usize, row: &mut Vec<Entry>) {
    let range = rows.offsets[particle] as usize..rows.offsets[particle + 1] as usize;
    row.clear();
    row.extend(range.map(|at| (rows.columns[at].wrapping_sub(particle as u32), rows.kinds[at])));
}

struct Builder<'a> {
    springs: &'a Springs,
    /// Words of `entries` that a spring takes.
    words: usize,
    row_numbers: Vec<u32>,
    headers: Vec<[u32; 2]>,
    entries: Vec<[u32; 4]>,
    shared: HashMap<Vec<Entry>, u32>,
}

impl Builder<'_> {
    fn entry(&self, (offset, kind): Entry) -> [[u32; 4]; BUCKLING_WORDS] {
        let kind = &self.springs.kinds()[kind as usize];
        let [rest_length, stiffness, damping] =
            [kind.rest_length, kind.stiffness, kind.damping].map(|value| (value as f32).to_bits());
        let [first, second] = buckling(kind);
        [[offset, rest_length, stiffness, damping], first, second]
    }

    fn push_shared(&mut self, row: &[Entry]) {
        if let Some(&number) = self.shared.get(row) {
            self.row_numbers.push(number);
            return;
        }
        let number = self.headers.len() as u32;
        self.headers.push([self.entries.len() as u32, row.len() as u32]);
        for &entry in row {
            let entry = self.entry(entry);
            self.entries.extend(&entry[..self.words]);
        }
        self.shared.insert(row.to_vec(), number);
        self.row_numbers.push(number);
    }

    fn push_slice(&mut self, slice: &[(usize, Vec<Entry>)]) {
        let start = self.entries.len();
        let longest = slice.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
        let words = self.words;
        self.entries.resize(start + words * longest * SLICE, [0; 4]);
        for (lane, (particle, row)) in slice.iter().enumerate() {
            self.row_numbers[*particle] = self.headers.len() as u32;
            let shape = row.len() as u32 | SLICE_SHIFT << 24;
            let first = start + words * lane;
            self.headers.push([first as u32, shape]);
            for (k, &entry) in row.iter().enumerate() {
                let entry = self.entry(entry);
                let at = first + words * k * SLICE;
                self.entries[at..at + words].copy_from_slice(&entry[..words]);
            }
        }
    }

    fn finish(mut self) -> (Vec<u32>, Vec<[u32; 4]>) {
        self.row_numbers.extend(self.headers.iter().flatten());
        (self.row_numbers, self.entries)
    }
}

/// What a spring has beside its stiffness.
fn buckling(kind: &SpringKind) -> [[u32; 4]; 2] {
    let buckling = kind.buckling().map_or_else(Buckling::never, |buckling| buckling.rounded());
    let Buckling::<f32> {
        force_scale,
        inverse_rest_length,
        energy_offset,
        stiff_compression,
        stiff_energy,
    } = buckling;
    let force_scale = force_scale.min(NEVER_FORCE_SCALE);
    let first = [force_scale, inverse_rest_length, energy_offset, stiff_compression];
    [first.map(f32::to_bits), [stiff_energy.to_bits(), 0, 0, 0]]
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, Stencil, TriangleMesh,
    };

    use super::*;

    fn model(geometry: Geometry) -> Model {
        let material = MaterialPreset::ALL[0].material(geometry.spacing());
        let name = "cloth".to_owned();
        let cloth = Cloth { name, geometry, material, pins: vec![], velocity: [0.0; 3] };
        ModelBuilder::new().cloth(cloth).build().unwrap()
    }

    /// Reads the tables as the kernels do: the neighbours and rest lengths of every particle.
    fn read_back(model: &Model) -> Vec<Vec<(usize, u32)>> {
        let (rows, entries) = tables(model);
        let count = model.particle_count();
        let row = |particle: usize| {
            let header = count + 2 * rows[particle] as usize;
            let [first, shape] = [rows[header], rows[header + 1]];
            let stride = 1_usize << (shape >> 24);
            (0..(shape & 0xff_ffff) as usize)
                .map(|k| entries[first as usize + k * stride])
                .map(|entry| ((particle as u32).wrapping_add(entry[0]) as usize, entry[1]))
                .collect()
        };
        (0..count).map(row).collect()
    }

    fn expected(model: &Model) -> Vec<Vec<(usize, u32)>> {
        let rows = model.springs().gather_rows();
        let kinds = model.springs().kinds();
        let row = |particle: usize| {
            let range = rows.offsets[particle] as usize..rows.offsets[particle + 1] as usize;
            range
                .map(|at| {
                    let rest_length = kinds[rows.kinds[at] as usize].rest_length as f32;
                    (rows.columns[at] as usize, rest_length.to_bits())
                })
                .collect()
        };
        (0..model.particle_count()).map(row).collect()
    }

    #[test]
    fn patches_of_any_size_share_their_rows() {
        let grid = |columns, rows, stencil| {
            let patch = GridPatch { columns, rows, stencil, ..GridPatch::horizontal(2, 0.02, 0.0) };
            model(Geometry::Grid(patch))
        };
        for (columns, rows, stencil) in [
            (40, 30, Stencil::Neighbours12),
            (17, 9, Stencil::Neighbours24),
            (2, 2, Stencil::Neighbours12),
        ] {
            let model = grid(columns, rows, stencil);
            assert_eq!(read_back(&model), expected(&model));
        }
        let entries = |side| tables(&grid(side, side, Stencil::Neighbours12)).1.len();
        assert_eq!(entries(40), entries(80));
    }

    #[test]
    fn a_mesh_without_order_loses_no_spring() {
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
        assert_eq!(read_back(&model), expected(&model));
    }
}
