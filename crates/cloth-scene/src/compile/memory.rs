//! How much memory a scene needs, before any of it is taken.

use crate::{
    Scene, SceneError, SceneGeometry, SceneMesh, SceneMeshing, SceneModel, ScenePrecision,
    SceneRigidShape, SceneShape, SceneStencil,
};

use super::{CompileOptions, memory_solver, mesh, mesh_vertices::vertex_count, panels, solid};

/// Estimate of the memory for model, solver and the frame that is written, at the peak.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Particles of all cloths; for meshes in glTF files, a guess from the size of the file.
    pub particles: u64,
    /// Bytes.
    pub bytes: u64,
}

/// Numbers of a solver for each particle: positions, velocities and forces, the first two doubled
/// where stages cannot work in place.
const SOLVER_NUMBERS: u64 = 15;

/// Bytes for each spring: column and kind.
const SPRING_BYTES: u64 = 8;

/// Bytes for each particle of the contact search: cell, order, and lists of what is near.
const CONTACT_BYTES: u64 = 56;

/// Bytes for each particle beside these: the model, its state and its triangles in double precision, and what the choice of a
/// time step takes while the scene is compiled. This and all other figures here and in `memory_solver` were fitted to the peak of the
/// resident memory of `cloth run --format none` with patches of 125 x 125 to 1000 x 1000 particles, both stencils and precisions.
const OTHER_BYTES: u64 = 344;

/// Further bytes for each particle of a mesh: the file, its polygons and the edges while springs
/// are made of them.
const MESH_BYTES: u64 = 270;

/// Springs for each vertex of a mesh: three edges and the three bend springs across them.
const MESH_SPRINGS: u64 = 6;

/// Bytes for each particle of a cloth of fabric: two triangles of the model with their neighbours and rest shapes, and the edges while
/// these are found.
const FABRIC_BYTES: u64 = 2600;

/// Numbers of a solver for each particle of a cloth of fabric: forces, tangents and blocks of two triangles.
const FABRIC_NUMBERS: u64 = 880;

/// Bytes of a vertex of a body at one time.
const VERTEX_BYTES: u64 = 24;

impl Scene {
    /// Estimates the memory that the model and a solver on the CPU need at their peak, without that of the program itself.
    ///
    /// Vertices are taken from the header of a PLY file and counted in an OBJ file, which is
    /// scanned for them; for glTF they are guessed from the size of the file, without its external
    /// buffers. Files that are missing or cannot be read count nothing.
    #[must_use]
    pub fn memory_estimate(&self, options: &CompileOptions) -> MemoryEstimate {
        let number = match self.simulation.precision {
            ScenePrecision::F32 => 4,
            ScenePrecision::F64 => 8,
        };
        let contact = if self.contact_chosen().is_some() { CONTACT_BYTES } else { 0 };
        let particle = SOLVER_NUMBERS * number + OTHER_BYTES + contact;
        let mut estimate = MemoryEstimate::default();
        let (mut springs, mut fabric) = (0_u64, false);
        for cloth in &self.cloths {
            let is_fabric = cloth.model_chosen() == SceneModel::Fabric;
            let (particles, mut springs_each, mut building) = match &cloth.geometry {
                SceneGeometry::Grid(grid) if is_fabric => {
                    let corners = u64::from(grid.columns) * u64::from(grid.rows);
                    let middles = grid.meshing == Some(SceneMeshing::UnionJack);
                    (if middles { corners.saturating_mul(2) } else { corners }, 0, 0)
                }
                SceneGeometry::Grid(grid) => {
                    let springs = match grid.stencil {
                        SceneStencil::Neighbours12 => 6,
                        SceneStencil::Neighbours24 => 12,
                    };
                    (u64::from(grid.columns) * u64::from(grid.rows), springs, 0)
                }
                SceneGeometry::Triangles(triangles) => {
                    (triangles.vertices.len() as u64, MESH_SPRINGS, MESH_BYTES)
                }
                SceneGeometry::Panels(described) => {
                    let read = panels::particles(&self.origin.directory, described, options);
                    (read, MESH_SPRINGS, MESH_BYTES)
                }
                SceneGeometry::Network(network) => {
                    // A prototype has at most six springs to later particles.
                    let joints = network.joints.len() as u64;
                    let particles = network.positions.len() as u64;
                    let each = 6 * network.prototypes.len() as u64;
                    (particles, each + joints.div_ceil(particles.max(1)), MESH_BYTES)
                }
                SceneGeometry::Mesh(mesh) => {
                    (self.mesh_vertices(mesh, options), MESH_SPRINGS, MESH_BYTES)
                }
            };
            fabric |= is_fabric;
            if is_fabric {
                springs_each = 0;
                building += FABRIC_BYTES + FABRIC_NUMBERS * number;
            }
            let bytes = particles.saturating_mul(particle + springs_each * SPRING_BYTES + building);
            estimate.particles = estimate.particles.saturating_add(particles);
            estimate.bytes = estimate.bytes.saturating_add(bytes);
            springs = springs.saturating_add(particles.saturating_mul(springs_each));
        }
        let of_triangles = solid::of_triangles(self);
        let solid_bytes = |cells: Option<u32>| if of_triangles { 0 } else { solid::bytes(cells) };
        let colliders = self.colliders.iter().map(|collider| match &collider.shape {
            SceneShape::Mesh(mesh) => solid_bytes(mesh.cells),
            SceneShape::Tetrahedron { .. } => solid_bytes(None),
            SceneShape::Animation(animation) if of_triangles => {
                let first = animation.file.replace("{}", &animation.first.to_string());
                let vertices = self.file_vertices(&first, options);
                super::animation::sets(animation).saturating_mul(VERTEX_BYTES * vertices)
            }
            SceneShape::Mannequin(described) => {
                let each = match of_triangles {
                    true => VERTEX_BYTES * super::mannequin::vertices(described),
                    false => solid::bytes(described.cells),
                };
                super::mannequin::sets(described).saturating_mul(each)
            }
            SceneShape::Animation(animation) => super::animation::sets(animation)
                .saturating_mul(solid::bytes(Some(animation.cells))),
            _ => 0,
        });
        let rigids = self.rigids.iter().map(|rigid| match &rigid.shape {
            SceneRigidShape::Mesh(mesh) => solid_bytes(mesh.cells),
            SceneRigidShape::Tetrahedron { .. } => solid_bytes(None),
            _ => 0,
        });
        let solids = colliders.chain(rigids).fold(0, u64::saturating_add);
        estimate.bytes = estimate.bytes.saturating_add(solids);
        let counts = (estimate.particles, springs, fabric);
        let solver = memory_solver::bytes(&self.simulation, counts, number);
        estimate.bytes = estimate.bytes.saturating_add(solver);
        estimate
    }

    fn mesh_vertices(&self, mesh: &SceneMesh, options: &CompileOptions) -> u64 {
        self.file_vertices(&mesh.file, options)
    }

    fn file_vertices(&self, file: &str, options: &CompileOptions) -> u64 {
        mesh::resolve(&self.origin.directory, file, options)
            .and_then(|path| vertex_count(&path).ok())
            .unwrap_or(0)
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
