//! Solids of any shape.

use std::sync::Arc;

use cloth_core::{ColliderShape, TriangleMesh};
use cloth_rigid::{RigidError, distance_grid, distance_grid_sequence};

use crate::{SceneAnimation, SceneError, SceneMesh, SceneTriangles};

use super::{Check, CompileOptions};

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

/// Most files of an animation.
const FRAMES_MAX: u32 = 10_000;

/// The signed distances of a mesh that changes its shape.
pub(super) fn animated(
    check: &Check<'_>,
    key: &str,
    name: &str,
    animation: &SceneAnimation,
    options: &CompileOptions,
) -> Result<ColliderShape, SceneError> {
    let wrong = |field: &str, problem: String| SceneError::Value {
        place: check.place(&format!("{key}.{field}")),
        problem,
    };
    check.positive(&format!("{key}.rate"), animation.rate)?;
    if !animation.file.contains("{}") {
        let problem = format!("`{}` has no `{{}}` in the place of the number", animation.file);
        return Err(wrong("file", problem));
    }
    if !(1..=FRAMES_MAX).contains(&animation.frames) {
        let problem = format!("{} files: give 1 to {FRAMES_MAX}", animation.frames);
        return Err(wrong("frames", problem));
    }
    if !(4..=400).contains(&animation.cells) {
        return Err(wrong("cells", format!("{} cells: give 4 to 400", animation.cells)));
    }
    let file = |number: u32| -> Result<TriangleMesh, SceneError> {
        let number = u64::from(animation.first) + u64::from(number);
        let mesh = SceneMesh {
            file: animation.file.replace("{}", &number.to_string()),
            scale: animation.scale,
            rotation: animation.rotation,
            translation: animation.translation,
        };
        super::mesh::compile(check, key, &mesh, options)
    };
    let meshes: Vec<_> = (0..animation.frames).map(file).collect::<Result<_, _>>()?;
    let grid = distance_grid_sequence(name, &meshes, animation.rate, (animation.cells, MARGIN))
        .map_err(|error| place(check, key, &error))?;
    Ok(ColliderShape::Grid(Arc::new(grid)))
}

pub(super) fn place(check: &Check<'_>, key: &str, error: &RigidError) -> SceneError {
    SceneError::Value { place: check.place(key), problem: error.to_string() }
}
