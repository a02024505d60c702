//! Signed distances of a closed mesh on a grid.

use cloth_core::{DistanceGrid, TriangleMesh};
use rapier3d_f64::parry::{
    query::PointQuery,
    shape::{TriMesh, TriMeshFlags},
};

use crate::{
    RigidError,
    mesh::{closed, holes_close, vector},
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
    grid_of(name, &[&mesh.positions], triangles, (cells, margin))
}

/// The same for a solid that changes its shape: one set of samples for each of `meshes`, `rate` of them for a
/// second \[1/s\]. All have the same faces. Where they are open, as sleeves are, each hole is closed by faces from its edge to its middle.
///
/// # Errors
/// [`RigidError`], naming the solid `name`, for meshes with different faces, or with faces that wind
/// differently.
pub fn distance_grid_sequence(
    name: &str,
    meshes: &[TriangleMesh],
    rate: f64,
    (cells, margin): (u32, f64),
) -> Result<DistanceGrid, RigidError> {
    let Some(first) = meshes.first() else { return Err(RigidError::Flat { name: name.into() }) };
    let same = |mesh: &TriangleMesh| {
        mesh.triangles == first.triangles && mesh.positions.len() == first.positions.len()
    };
    if let Some(frame) = meshes.iter().position(|mesh| !same(mesh)) {
        return Err(RigidError::FacesDiffer { name: name.into(), frame });
    }
    let caps = holes_close(first);
    let positions: Vec<_> = meshes.iter().map(|mesh| caps.positions(&mesh.positions)).collect();
    let whole = TriangleMesh {
        positions: positions[0].clone(),
        triangles: caps.triangles,
        ..TriangleMesh::default()
    };
    let triangles = closed(name, &whole)?;
    let sets: Vec<_> = positions.iter().map(Vec::as_slice).collect();
    let mut grid = grid_of(name, &sets, triangles, (cells, margin))?;
    grid.rate = rate;
    grid.later_positions = positions.into_iter().skip(1).collect();
    Ok(grid)
}

/// One set of samples for each set of vertices, on a grid that holds them all.
fn grid_of(
    name: &str,
    sets: &[&[[f64; 3]]],
    triangles: Vec<[u32; 3]>,
    (cells, margin): (u32, f64),
) -> Result<DistanceGrid, RigidError> {
    let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
        sets.iter().copied().flatten().fold([start; 3], |bound, position| {
            std::array::from_fn(|axis| pick(bound[axis], position[axis]))
        })
    };
    let (low, high) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
    let longest = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let spacing = longest / f64::from(cells.clamp(CELLS_MIN, CELLS_MAX));
    if !(spacing > 0.0 && longest.is_finite() && margin.is_finite()) {
        return Err(RigidError::Flat { name: name.into() });
    }
    // Gradients need a cell beyond the margin.
    let border = margin.clamp(0.0, MARGIN_MAX * longest) + 2.0 * spacing;
    let origin: [f64; 3] = low.map(|value| value - border);
    let size: [u32; 3] = std::array::from_fn(|axis| {
        ((high[axis] + border - origin[axis]) / spacing).ceil() as u32 + 1
    });
    let count = size.iter().map(|&side| side as usize).product::<usize>();
    if (count as u64).saturating_mul(sets.len() as u64) > DistanceGrid::SAMPLES_MAX {
        return Err(RigidError::TooManySamples { name: name.into(), sets: sets.len(), count });
    }
    let mut distances = vec![0.0; count * sets.len()];
    let lattice = Lattice { origin, spacing, size };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    // Sets in turns, as none depends on another.
    let outcome = std::thread::scope(|scope| {
        let share = sets.len().div_ceil(threads);
        let work = distances.chunks_mut(count * share).zip(sets.chunks(share));
        let running: Vec<_> = work
            .map(|(out, sets)| {
                let triangles = &triangles;
                scope.spawn(move || {
                    let mut pairs = out.chunks_mut(count).zip(sets);
                    pairs.try_for_each(|(out, set)| lattice.sample(set, triangles, out))
                })
            })
            .collect();
        running.into_iter().try_for_each(|thread| {
            thread.join().unwrap_or_else(|_| Err("the library failed".to_owned()))
        })
    });
    outcome.map_err(|problem| RigidError::Shape { name: name.into(), problem })?;
    let surface =
        TriangleMesh { positions: sets[0].to_vec(), triangles, ..TriangleMesh::default() };
    Ok(DistanceGrid { origin, spacing, size, distances, surface, ..DistanceGrid::default() })
}

/// Where samples are.
#[derive(Clone, Copy)]
struct Lattice {
    origin: [f64; 3],
    spacing: f64,
    size: [u32; 3],
}

impl Lattice {
    /// Samples one mesh.
    fn sample(
        self,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        out: &mut [f32],
    ) -> Result<(), String> {
        let positions = positions.iter().copied().map(vector).collect();
        let shape = TriMesh::with_flags(positions, triangles.to_vec(), TriMeshFlags::ORIENTED)
            .map_err(|error| error.to_string())?;
        let [width, height, _] = self.size.map(|side| side as usize);
        for (number, out) in out.iter_mut().enumerate() {
            let index = [number % width, number / width % height, number / (width * height)];
            let point = vector(std::array::from_fn(|axis| {
                self.origin[axis] + self.spacing * index[axis] as f64
            }));
            let projection = shape.project_local_point(point, false);
            let distance = (point - projection.point).length();
            *out = if projection.is_inside { -distance } else { distance } as f32;
        }
        Ok(())
    }
}
