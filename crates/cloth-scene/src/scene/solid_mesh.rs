//! Solids of any shape.

use serde::{Deserialize, Serialize};

use super::{SceneRotation, SceneTriangles};

/// A triangle mesh: from a file, or vertex by vertex in the scene itself. It is scaled, then rotated, then
/// translated. With contact of triangles the cloth touches its faces, and it may be open. Else it must be closed, and the cloth knows it by
/// signed distances at samples of a regular grid. Rigid bodies are closed.
///
/// Either `file` is given, or `vertices` and `faces` are.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneSolidMesh {
    /// The file, relative to the folder of the scene file, with forward slashes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Positions \[m\].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vertices: Vec<[f64; 3]>,
    /// Vertices of each triangle, from 0, counter-clockwise seen from outside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faces: Vec<[u32; 3]>,
    /// Factor on all coordinates, above zero; 1 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub scale: Option<f64>,
    /// Rotation about the origin of the mesh; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Translation of the mesh in the frame of the solid \[m\]; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<[f64; 3]>,
    /// Samples of the distance along the longest side, 4 to 400; 64 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 4, max = 400)))]
    pub cells: Option<u32>,
}

impl SceneSolidMesh {
    /// The solid in a mesh file.
    #[must_use]
    pub fn file(file: &str) -> Self {
        Self { file: Some(file.into()), ..Self::from(SceneTriangles::default()) }
    }
}

impl From<SceneTriangles> for SceneSolidMesh {
    fn from(SceneTriangles { vertices, faces, .. }: SceneTriangles) -> Self {
        Self {
            file: None,
            vertices,
            faces,
            scale: None,
            rotation: None,
            translation: None,
            cells: None,
        }
    }
}
