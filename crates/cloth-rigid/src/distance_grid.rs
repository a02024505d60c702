//! Signed distances of a closed mesh on a grid.

use cloth_core::{DistanceGrid, TriangleMesh};
use rapier3d_f64::parry::{
    query::PointQuery,
    shape::{TriMesh, TriMeshFlags},
};

use crate::{
    RigidError,
    mesh::{closed, vector},
};

/// Least samples along the longest side of a solid.
const CELLS_MIN: u32 = 4;
/// Most of them.
const CELLS_MAX: u32 = 400;
/// Largest margin in units of the longest side.
const MARGIN_MAX: f64 = 0.25;

/// Samples the signed distance of a closed mesh, with `cells` cells (4 to 400) along its longest side, out to
/// `margin` \[m\] beyond it, at most a quarter of that side. Distances are exact at the samples, to single precision; NUMERICS §7 says
/// what interpolation makes of them.
///
/// # Errors
/// [`RigidError`], naming the solid `name`, for a mesh that is not closed.
pub fn distance_grid(
    name: &str,
    mesh: &TriangleMesh,
    cells: u32,
    margin: f64,
) -> Result<DistanceGrid, RigidError> {
    let triangles = closed(name, mesh)?;
    let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
        mesh.positions.iter().fold([start; 3], |bound, position| {
            std::array::from_fn(|axis| pick(bound[axis], position[axis]))
        })
    };
    let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
    let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let spacing = longest / f64::from(cells.clamp(CELLS_MIN, CELLS_MAX));
    if !(spacing > 0.0 && margin.is_finite()) {
        return Err(RigidError::Flat { name: name.into() });
    }
    // Gradients need a cell beyond the margin.
    let border = margin.clamp(0.0, MARGIN_MAX * longest) + 2.0 * spacing;
    let origin: [f64; 3] = low.map(|value| value - border);
    let size: [u32; 3] = std::array::from_fn(|axis| {
        ((high[axis] + border - origin[axis]) / spacing).ceil() as u32 + 1
    });
    let positions = mesh.positions.iter().copied().map(vector).collect();
    let shape = TriMesh::with_flags(positions, triangles.clone(), TriMeshFlags::ORIENTED)
        .map_err(|error| RigidError::Shape { name: name.into(), problem: error.to_string() })?;
    let mut distances = Vec::with_capacity(size.iter().map(|&side| side as usize).product());
    for k in 0..size[2] {
        for j in 0..size[1] {
            for i in 0..size[0] {
                let index = [i, j, k];
                let point = vector(std::array::from_fn(|axis| {
                    origin[axis] + spacing * f64::from(index[axis])
                }));
                let projection = shape.project_local_point(point, false);
                let distance = (point - projection.point).length();
                distances.push(if projection.is_inside { -distance } else { distance } as f32);
            }
        }
    }
    let surface =
        TriangleMesh { positions: mesh.positions.clone(), triangles, ..TriangleMesh::default() };
    Ok(DistanceGrid { origin, spacing, size, distances, surface })
}
