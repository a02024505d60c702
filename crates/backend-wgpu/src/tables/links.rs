//! The springs as blocks of the matrix, in the form of `shared/links.wgsl`.
//!
//! Both ends of a spring share one place for its direction and factors. The springs of a particle to
//! later ones have places of their own column: place r n + i for the r-th of particle i, so that
//! neighbouring particles of a patch read side by side. Particles with more springs than [`COLUMNS_MAX`], as
//! they occur in meshes, have further places after all columns.

use cloth_core::Model;

use super::rows::{Rows, rows_of};

/// Springs to later particles that have a column: those of a patch with 24 neighbours.
const COLUMNS_MAX: usize = 12;

/// Contents of the buffers of links.
#[derive(Debug, Default)]
pub(crate) struct LinkTables {
    pub(crate) rows: Vec<[u32; 2]>,
    pub(crate) entries: Vec<[u32; 2]>,
    pub(crate) kinds: Vec<u32>,
    /// Places of springs.
    pub(crate) places: usize,
    /// Largest distance of the numbers of two particles that the matrix couples.
    pub(crate) reach: u32,
}

impl LinkTables {
    pub(crate) fn new(model: &Model) -> Self {
        let count = model.particle_count();
        let gather = model.springs().gather_rows();
        let range = |i: usize| gather.offsets[i] as usize..gather.offsets[i + 1] as usize;
        let later = |i: usize| range(i).filter(|&at| gather.columns[at] as usize > i).count();
        let columns = (0..count).map(later).max().unwrap_or(0).min(COLUMNS_MAX);
        let mut place = vec![0_u32; gather.columns.len()];
        let mut next = columns * count;
        // Places given by the earlier particle, in the order in which the later one meets them.
        let mut given = vec![Vec::new(); count];
        for i in 0..count {
            let mut earlier = std::mem::take(&mut given[i]).into_iter();
            let mut rank = 0;
            for at in range(i) {
                let j = gather.columns[at] as usize;
                if j < i {
                    place[at] = earlier.next().unwrap_or_default();
                    continue;
                }
                let own = if rank < columns {
                    rank * count + i
                } else {
                    next += 1;
                    next - 1
                };
                rank += 1;
                place[at] = own as u32;
                given[j].push(own as u32);
            }
        }
        let Rows { rows, entries } = rows_of(count, |i| {
            let entry = |at: usize| {
                let relative = |number: u32| number.wrapping_sub(i as u32);
                [relative(gather.columns[at]), relative(place[at]), gather.kinds[at]]
            };
            range(i).map(entry).collect()
        });
        Self {
            rows,
            kinds: entries.iter().map(|&[_, _, kind]| kind).collect(),
            entries: entries.into_iter().map(|[offset, place, _]| [offset, place]).collect(),
            places: next,
            reach: model.interactions().in_matrix().reach(),
        }
    }

    /// The springs of a particle: other end, place.
    pub(crate) fn row(&self, particle: usize) -> impl Iterator<Item = [usize; 2]> {
        let [first, shape] = self.rows[particle];
        let first = first as usize;
        let stride = 1_usize << (shape >> 24);
        (0..(shape & 0xff_ffff) as usize).map(move |k| {
            self.entries[first + k * stride]
                .map(|number| number.wrapping_add(particle as u32) as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use cloth_core::{
        Cloth, Geometry, GridPatch, MaterialPreset, ModelBuilder, Stencil, TriangleMesh,
    };

    use super::*;

    fn check(geometry: Geometry) -> LinkTables {
        let material = MaterialPreset::ALL[0].material(geometry.spacing());
        let name = "cloth".to_owned();
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let tables = LinkTables::new(&model);
        let count = model.particle_count();
        let mut ends: HashMap<usize, Vec<[usize; 2]>> = HashMap::new();
        for i in 0..count {
            for [j, place] in tables.row(i) {
                assert!(place < tables.places);
                ends.entry(place).or_default().push([i.min(j), i.max(j)]);
            }
        }
        assert_eq!(ends.len(), model.springs().len());
        assert!(ends.values().all(|both| both.len() == 2 && both[0] == both[1]));
        tables
    }

    #[test]
    fn both_ends_of_a_spring_share_its_place() {
        let patch = |side, stencil| {
            Geometry::Grid(GridPatch { stencil, ..GridPatch::horizontal(side, 0.02, 0.0) })
        };
        let small = check(patch(30, Stencil::Neighbours24));
        let large = check(patch(60, Stencil::Neighbours24));
        assert_eq!(small.entries.len(), large.entries.len(), "patches share their rows");
        assert_eq!((small.reach, large.reach), (62, 122), "two rows and two columns");
        check(patch(9, Stencil::Neighbours12));
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
        check(Geometry::Mesh(mesh));
    }
}
