//! Solids of any shape.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use cloth_core::{BodySurface, Collider, ColliderShape, TriangleMesh};
use cloth_rigid::{DistanceGridPlan, RigidError};

use crate::{Scene, SceneContactResponse, SceneError, SceneMesh, SceneSolidMesh};

use super::{Check, CompileOptions, CompileProgress};

/// Samples along the longest side of a solid.
pub(super) const CELLS: u32 = 64;
/// How far beyond a solid distances are sampled \[m\]; farther than half the thickness of any cloth.
pub(super) const MARGIN: f64 = 0.02;

/// Bytes of the samples of one solid at most, with so many samples along its longest side: the margin is at most a
/// quarter of it on both ends, and gradients need some more.
pub(super) fn bytes(cells: Option<u32>) -> u64 {
    let side = 3 * u64::from(cells.unwrap_or(CELLS)) / 2 + 5;
    side.saturating_pow(3).saturating_mul(4)
}

/// Whether cloth knows meshes by their triangles.
pub(super) fn of_triangles(scene: &Scene) -> bool {
    let response = scene.contact_chosen().map(|contact| contact.response);
    matches!(response, Some(SceneContactResponse::Triangles { .. }))
}

/// The solids whose distances are to be sampled, in the order of their colliders.
pub(super) struct Plans {
    list: Vec<(String, DistanceGridPlan)>,
    /// Whether cloth knows meshes by their triangles, and no distances are needed.
    of_triangles: bool,
}

impl Plans {
    /// None, for a scene.
    pub(super) fn new(scene: &Scene) -> Self {
        Self { list: Vec::new(), of_triangles: of_triangles(scene) }
    }

    /// Whether cloth knows meshes by their triangles.
    pub(super) const fn of_triangles(&self) -> bool {
        self.of_triangles
    }

    /// Stands for the solid until its distances are known; errors are about `key`.
    pub(super) fn draft(&mut self, key: &str, plan: DistanceGridPlan) -> ColliderShape {
        let draft = plan.draft();
        self.list.push((key.to_owned(), plan));
        ColliderShape::Grid(Arc::new(draft))
    }

    pub(super) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Samples all distances, and gives them to `colliders` in the place of the drafts.
    pub(super) fn carry_out(
        self,
        check: &Check<'_>,
        colliders: &mut [Collider],
        progress: &(dyn Fn(CompileProgress) + Sync),
    ) -> Result<(), SceneError> {
        let total = self.list.iter().map(|(_, plan)| plan.samples()).sum();
        let done = AtomicU64::new(0);
        let shapes = colliders.iter_mut().filter_map(|collider| match &mut collider.shape {
            ColliderShape::Grid(grid) => Some(grid),
            _ => None,
        });
        for ((key, plan), grid) in self.list.into_iter().zip(shapes) {
            let sampled = plan.sample(&|samples| {
                let done = done.fetch_add(samples, Ordering::Relaxed) + samples;
                progress(CompileProgress { done, total });
            });
            *grid = Arc::new(sampled.map_err(|error| place(check, &key, &error))?);
        }
        Ok(())
    }
}

/// The mesh of a solid at `key`, and the samples along its longest side.
pub(super) fn mesh(
    check: &Check<'_>,
    key: &str,
    solid: &SceneSolidMesh,
    options: &CompileOptions,
) -> Result<(TriangleMesh, u32), SceneError> {
    let SceneSolidMesh { file, vertices, faces, scale, rotation, translation, cells } = solid;
    let inline = !vertices.is_empty() || !faces.is_empty();
    let scale = scale.unwrap_or(1.0);
    let translation = translation.unwrap_or_default();
    let mesh = match file {
        Some(_) if inline => {
            return Err(check.error(key, "has a `file` and `vertices` or `faces`: remove one"));
        }
        None if !inline => {
            return Err(check.error(key, "has no `file`: give it, or `vertices` and `faces`"));
        }
        Some(file) => {
            let mesh = SceneMesh { file: file.clone(), scale, rotation: *rotation, translation };
            super::mesh::compile(check, key, &mesh, options)?
        }
        None => {
            let mut mesh = TriangleMesh {
                positions: vertices.clone(),
                triangles: faces.clone(),
                ..TriangleMesh::default()
            };
            super::mesh::transform(check, key, (scale, *rotation, translation), &mut mesh)?;
            mesh
        }
    };
    let cells = cells.unwrap_or(CELLS);
    cells_check(check, key, cells)?;
    Ok((mesh, cells))
}

/// The shape of a mesh, which must be closed where cloth is to know it by distances; errors are about `key`.
pub(super) fn distances(
    check: &Check<'_>,
    key: &str,
    name: &str,
    (mesh, cells): (&TriangleMesh, u32),
    plans: &mut Plans,
) -> Result<ColliderShape, SceneError> {
    if plans.of_triangles {
        let surface = BodySurface::rigid(mesh.positions.clone(), mesh.triangles.clone());
        return Ok(ColliderShape::Surface(Arc::new(surface)));
    }
    let plan = DistanceGridPlan::new(name, mesh, (cells, MARGIN));
    Ok(plans.draft(key, plan.map_err(|error| place(check, key, &error))?))
}

pub(super) fn cells_check(check: &Check<'_>, key: &str, cells: u32) -> Result<(), SceneError> {
    if (4..=400).contains(&cells) {
        Ok(())
    } else {
        Err(check.error(&format!("{key}.cells"), &format!("is {cells}: give 4 to 400")))
    }
}

pub(super) fn tetrahedron(vertices: &[[f64; 3]; 4]) -> TriangleMesh {
    TriangleMesh {
        positions: vertices.to_vec(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    }
}

pub(super) fn place(check: &Check<'_>, key: &str, error: &RigidError) -> SceneError {
    SceneError::Value { place: check.place(key), problem: error.to_string() }
}
