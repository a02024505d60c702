//! How much memory a scene needs, before any of it is taken.

use crate::{Scene, SceneError, SceneGeometry, SceneMesh, ScenePrecision, SceneStencil};

use super::{CompileOptions, mesh};

/// Estimate of the memory for model and solver together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Particles of all cloths; of meshes, as many as their files can hold.
    pub particles: u64,
    /// Bytes.
    pub bytes: u64,
}

/// Bytes of the model for each particle: start position and mass in double precision, two triangles.
const MODEL_BYTES: u64 = 24 + 8 + 24;

/// Bytes for each spring: once in the model, twice in the rows of a solver (column and kind each).
const SPRING_BYTES: u64 = 8 + 16;

/// Numbers of a solver for each particle: positions, velocities and forces, the first two doubled
/// where stages cannot work in place.
const SOLVER_NUMBERS: u64 = 15;

/// Bytes of a solver for each particle beside these: triangles around it, its state for output.
const SOLVER_BYTES: u64 = 24 + 24 + 24 + 1;

/// Bytes for each particle of the contact search: cell, order, and a list of some twenty
/// candidates.
const CONTACT_BYTES: u64 = 16 + 20 * 4;

/// Bytes of a mesh file for each vertex, at least: three 32-bit coordinates and two triangles of a
/// binary PLY.
const MESH_FILE_BYTES: u64 = 12 + 2 * 13;

/// Springs for each vertex of a mesh: three edges and the three bend springs across them.
const MESH_SPRINGS: u64 = 6;

impl Scene {
    /// Estimates the memory that the model and a solver on the CPU need. Right to a factor of two;
    /// nothing is read but the sizes of mesh files, and missing files count nothing.
    #[must_use]
    pub fn memory_estimate(&self, options: &CompileOptions) -> MemoryEstimate {
        let number = match self.simulation.precision {
            ScenePrecision::F32 => 4,
            ScenePrecision::F64 => 8,
        };
        let contact = if self.contact.is_some() { CONTACT_BYTES } else { 0 };
        let particle = MODEL_BYTES + SOLVER_NUMBERS * number + SOLVER_BYTES + contact;
        self.cloths.iter().fold(MemoryEstimate::default(), |sum, cloth| {
            let (particles, springs) = match &cloth.geometry {
                SceneGeometry::Grid(grid) => {
                    let springs = match grid.stencil {
                        SceneStencil::Neighbours12 => 6,
                        SceneStencil::Neighbours24 => 12,
                    };
                    (u64::from(grid.columns) * u64::from(grid.rows), springs)
                }
                SceneGeometry::Mesh(mesh) => (self.mesh_vertices(mesh, options), MESH_SPRINGS),
            };
            let bytes = particles.saturating_mul(particle + springs * SPRING_BYTES);
            MemoryEstimate {
                particles: sum.particles.saturating_add(particles),
                bytes: sum.bytes.saturating_add(bytes),
            }
        })
    }

    fn mesh_vertices(&self, mesh: &SceneMesh, options: &CompileOptions) -> u64 {
        mesh::resolve(&self.origin.directory, &mesh.file, options)
            .and_then(|path| std::fs::metadata(path).ok())
            .map_or(0, |metadata| metadata.len() / MESH_FILE_BYTES)
    }
}

pub(super) fn check(scene: &Scene, options: &CompileOptions) -> Result<(), SceneError> {
    let estimate = scene.memory_estimate(options);
    if estimate.bytes > options.memory_limit {
        return Err(SceneError::Memory {
            name: scene.name.clone(),
            particles: estimate.particles,
            needed: estimate.bytes,
            limit: options.memory_limit,
        });
    }
    Ok(())
}
