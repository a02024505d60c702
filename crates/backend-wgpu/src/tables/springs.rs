//! The springs of a model in the form of `shared/spring.wgsl`.
//!
//! Particles whose springs are alike, in offset and kind, share one row: a patch of any size needs a
//! few dozen rows for its inside, edges and corners.

use cloth_core::{Buckling, Model, SpringKind};

use super::rows::{Rows, rows_of};

/// Words of four numbers that a spring takes where some may buckle (`shared/spring_buckling.wgsl`).
const BUCKLING_WORDS: usize = 3;

/// Force scale of a spring that never buckles. In the reference it is infinite, which WGSL does not know; this
/// is a compressive force that no spring of finite stiffness exceeds.
const NEVER_FORCE_SCALE: f32 = 1e37;

/// Sign of the damping of a spring whose strain is not measured.
const UNMEASURED: u32 = 1 << 31;

/// Whether some spring of a model buckles.
pub(crate) fn may_buckle(model: &Model) -> bool {
    model.springs().kinds().iter().any(|kind| kind.rigidity.is_some())
}

/// Contents of `spring_rows` and `spring_entries`.
pub(super) fn tables(model: &Model) -> (Vec<[u32; 2]>, Vec<[u32; 4]>) {
    let gather = model.springs().gather_rows();
    let Rows { mut rows, entries } = rows_of(model.particle_count(), |particle| {
        let range = gather.offsets[particle] as usize..gather.offsets[particle + 1] as usize;
        let entry =
            |at: usize| [gather.columns[at].wrapping_sub(particle as u32), gather.kinds[at]];
        range.map(entry).collect::<Vec<[u32; 2]>>()
    });
    let words = words(model);
    for [first, _] in &mut rows {
        *first *= words as u32;
    }
    let kinds = kinds(model);
    let measured = model.springs().strain_measured();
    let entries = entries.into_iter().flat_map(|[offset, kind]| {
        let mut spring = kinds[kind as usize * words..][..words].to_vec();
        spring[0][0] = offset;
        if !measured[kind as usize] {
            spring[0][3] |= UNMEASURED;
        }
        spring
    });
    (rows, entries.collect())
}

/// Words that a spring takes.
fn words(model: &Model) -> usize {
    if may_buckle(model) { BUCKLING_WORDS } else { 1 }
}

/// All kinds of springs in the form of `spring_entries`, the offset left out.
pub(super) fn kinds(model: &Model) -> Vec<[u32; 4]> {
    let words = words(model);
    let kind = |kind: &SpringKind| {
        let [rest_length, stiffness, damping] =
            [kind.rest_length, kind.stiffness, kind.damping].map(|value| (value as f32).to_bits());
        let [first, second] = buckling(kind);
        [[0, rest_length, stiffness, damping], first, second].into_iter().take(words)
    };
    model.springs().kinds().iter().flat_map(kind).collect()
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
        let cloth =
            Cloth { name, geometry, material: material.into(), pins: vec![], velocity: [0.0; 3] };
        ModelBuilder::new().cloth(cloth).build().unwrap()
    }

    /// Reads the tables as the kernels do: the neighbours and rest lengths of every particle.
    fn read_back(model: &Model) -> Vec<Vec<(usize, u32)>> {
        let (rows, entries) = tables(model);
        let count = model.particle_count();
        let row = |particle: usize| {
            let [first, shape] = rows[particle];
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
