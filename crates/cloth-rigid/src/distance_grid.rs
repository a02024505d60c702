//! Signed distances of a closed mesh on a grid.

use std::panic::{AssertUnwindSafe, catch_unwind};

use cloth_core::{DistanceGrid, TriangleMesh};
use rapier3d_f64::parry::{
    query::PointQuery,
    shape::{TriMesh, TriMeshFlags},
};
use rayon::prelude::*;

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
    DistanceGridPlan::new(name, mesh, (cells, margin))?.sample(&|_| ())
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
    DistanceGridPlan::sequence(name, meshes, rate, (cells, margin))?.sample(&|_| ())
}

/// A solid that has been checked, and the places at which its distance is to be sampled. The check takes no time
/// worth mentioning, the sampling can take minutes.
#[derive(Clone, Debug)]
pub struct DistanceGridPlan {
    name: String,
    /// The vertices of each set.
    sets: Vec<Vec<[f64; 3]>>,
    triangles: Vec<[u32; 3]>,
    rate: f64,
    start: f64,
    skin: f64,
    lattice: Lattice,
}

impl DistanceGridPlan {
    /// A plan for [`distance_grid`].
    ///
    /// # Errors
    /// As there.
    pub fn new(
        name: &str,
        mesh: &TriangleMesh,
        (cells, margin): (u32, f64),
    ) -> Result<Self, RigidError> {
        let triangles = closed(name, mesh)?;
        Self::of(name, vec![mesh.positions.clone()], triangles, 0.0, (cells, margin))
    }

    /// A plan for [`distance_grid_sequence`].
    ///
    /// # Errors
    /// As there.
    pub fn sequence(
        name: &str,
        meshes: &[TriangleMesh],
        rate: f64,
        (cells, margin): (u32, f64),
    ) -> Result<Self, RigidError> {
        let Some(first) = meshes.first() else {
            return Err(RigidError::Flat { name: name.into() });
        };
        let same = |mesh: &TriangleMesh| {
            mesh.triangles == first.triangles && mesh.positions.len() == first.positions.len()
        };
        if let Some(frame) = meshes.iter().position(|mesh| !same(mesh)) {
            return Err(RigidError::FacesDiffer { name: name.into(), frame });
        }
        let caps = holes_close(first);
        let sets: Vec<_> = meshes.iter().map(|mesh| caps.positions(&mesh.positions)).collect();
        let positions = sets.first().cloned().unwrap_or_default();
        let whole =
            TriangleMesh { positions, triangles: caps.triangles, ..TriangleMesh::default() };
        let triangles = closed(name, &whole)?;
        Self::of(name, sets, triangles, rate, (cells, margin))
    }

    /// One set of samples for each set of vertices, on a grid that holds them all.
    fn of(
        name: &str,
        sets: Vec<Vec<[f64; 3]>>,
        triangles: Vec<[u32; 3]>,
        rate: f64,
        (cells, margin): (u32, f64),
    ) -> Result<Self, RigidError> {
        let bound = |pick: fn(f64, f64) -> f64, start: f64| -> [f64; 3] {
            sets.iter().flatten().fold([start; 3], |bound, position| {
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
            let cells = ((high[axis] + border - origin[axis]) / spacing).ceil();
            (cells as u32).saturating_add(1)
        });
        let lattice = Lattice { origin, spacing, size };
        Self { name: name.into(), sets, triangles, rate, start: 0.0, skin: 0.0, lattice }.checked()
    }

    fn checked(self) -> Result<Self, RigidError> {
        if self.samples() > DistanceGrid::SAMPLES_MAX {
            let (sets, count) = (self.sets.len(), self.lattice.count());
            return Err(RigidError::TooManySamples { name: self.name, sets, count });
        }
        Ok(self)
    }

    /// The same solid, whose first set holds until `start` \[s\].
    #[must_use]
    pub fn waiting(self, start: f64) -> Self {
        Self { start, ..self }
    }

    /// The same solid with a skin of this thickness \[m\] around it, which only distances know of.
    ///
    /// # Errors
    /// [`RigidError`] for a skin thicker than the grid is long, and for more samples than fit.
    pub fn with_skin(self, skin: f64) -> Result<Self, RigidError> {
        let longest = self.lattice.size.iter().copied().max().unwrap_or(0);
        let most = self.lattice.spacing * f64::from(longest);
        if skin > most {
            return Err(RigidError::ThickSkin { name: self.name, skin, most });
        }
        let cells = (skin / self.lattice.spacing).ceil().max(0.0);
        let lattice = Lattice {
            origin: self.lattice.origin.map(|value| value - cells * self.lattice.spacing),
            size: self.lattice.size.map(|side| side.saturating_add((2.0 * cells) as u32)),
            ..self.lattice
        };
        Self { skin, lattice, ..self }.checked()
    }

    /// Samples that will be taken, of all sets together.
    #[must_use]
    pub fn samples(&self) -> u64 {
        (self.lattice.count() as u64).saturating_mul(self.sets.len() as u64)
    }

    /// A grid with the surface and the times of the one to come, and distances that mean nothing: for checks.
    #[must_use]
    pub fn draft(&self) -> DistanceGrid {
        let lattice = Lattice { size: [2; 3], ..self.lattice };
        let distances = vec![0.0; lattice.count() * self.sets.len()];
        self.grid(lattice, distances)
    }

    fn grid(&self, lattice: Lattice, distances: Vec<f32>) -> DistanceGrid {
        let Lattice { origin, spacing, size } = lattice;
        let (first, later) = self
            .sets
            .split_first()
            .map_or((&[][..], &[][..]), |(first, later)| (first.as_slice(), later));
        DistanceGrid {
            origin,
            spacing,
            size,
            distances,
            rate: self.rate,
            start: self.start,
            skin: self.skin,
            surface: TriangleMesh {
                positions: first.to_vec(),
                triangles: self.triangles.clone(),
                ..TriangleMesh::default()
            },
            later_positions: later.to_vec(),
        }
    }

    /// Samples the distances with all cores. `progress` is told again and again, from any thread, how many samples
    /// have been taken since it was told last.
    ///
    /// # Errors
    /// [`RigidError::Shape`] for a mesh that the library refuses.
    pub fn sample(&self, progress: &(dyn Fn(u64) + Sync)) -> Result<DistanceGrid, RigidError> {
        let count = self.lattice.count();
        let mut distances = vec![0.0; count * self.sets.len()];
        // The library gives up on some meshes by a panic.
        let outcome = catch_unwind(AssertUnwindSafe(|| {
            let sets = distances.par_chunks_mut(count).zip(&self.sets);
            sets.try_for_each(|(out, set)| {
                self.lattice.sample((set, &self.triangles, self.skin), out, progress)
            })
        }));
        outcome
            .unwrap_or_else(|_| Err("the library failed".to_owned()))
            .map_err(|problem| RigidError::Shape { name: self.name.clone(), problem })?;
        Ok(self.grid(self.lattice, distances))
    }
}

/// Where samples are.
#[derive(Clone, Copy, Debug)]
struct Lattice {
    origin: [f64; 3],
    spacing: f64,
    size: [u32; 3],
}

impl Lattice {
    fn count(self) -> usize {
        self.size.iter().fold(1, |count: usize, &side| count.saturating_mul(side as usize))
    }

    /// Samples one mesh, row by row: rows depend on nothing but the mesh, so that their order does not matter.
    fn sample(
        self,
        (positions, triangles, skin): (&[[f64; 3]], &[[u32; 3]], f64),
        out: &mut [f32],
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<(), String> {
        let positions = positions.iter().copied().map(vector).collect();
        let shape = TriMesh::with_flags(positions, triangles.to_vec(), TriMeshFlags::ORIENTED)
            .map_err(|error| error.to_string())?;
        let [width, height, _] = self.size.map(|side| side as usize);
        out.par_chunks_mut(width).enumerate().for_each(|(number, row)| {
            for (column, out) in row.iter_mut().enumerate() {
                let index = [column, number % height, number / height];
                let point = vector(std::array::from_fn(|axis| {
                    self.origin[axis] + self.spacing * index[axis] as f64
                }));
                let projection = shape.project_local_point(point, false);
                let distance = (point - projection.point).length();
                let signed = if projection.is_inside { -distance } else { distance };
                *out = (signed - skin) as f32;
            }
            progress(row.len() as u64);
        });
        Ok(())
    }
}
