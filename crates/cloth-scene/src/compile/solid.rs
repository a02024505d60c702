//! Solids of any shape.

use std::sync::Arc;

use cloth_core::{ColliderShape, TriangleMesh};
use cloth_rigid::{RigidError, distance_grid};

use crate::{SceneError, SceneTriangles};

use super::Check;

/// Samples along the longest side of a solid.
const CELLS: u32 = 64;
/// How far beyond a solid distances are sampled \[m\]; farther than half the thickness of any cloth.
const MARGIN: f64 = 0.02;
/// Bytes of the samples of one solid at most.
pub(super) const BYTES: u64 = 4 << 20;

pub(super) fn mesh(triangles: &SceneTriangles) -> TriangleMesh {
    TriangleMesh {
        positions: triangles.vertices.clone(),
        triangles: triangles.faces.clone(),
        ..TriangleMesh::default()
    }
}

pub(super) fn tetrahedron(vertices: &[[f64; 3]; 4]) -> TriangleMesh {
    TriangleMesh {
        positions: vertices.to_vec(),
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    }
}

/// The signed distances of a closed mesh; errors are about `key`.
pub(super) fn distances(
    check: &Check<'_>,
    key: &str,
    name: &str,
    mesh: &TriangleMesh,
) -> Result<ColliderShape, SceneError> {
    let grid =
        distance_grid(name, mesh, CELLS, MARGIN).map_err(|error| place(check, key, &error))?;
    Ok(ColliderShape::Grid(Arc::new(grid)))
}

pub(super) fn place(check: &Check<'_>, key: &str, error: &RigidError) -> SceneError {
    SceneError::Value { place: check.place(key), problem: error.to_string() }
}
