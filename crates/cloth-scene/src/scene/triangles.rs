//! Triangle meshes that are part of the scene itself.

use serde::{Deserialize, Serialize};

/// A triangle mesh, vertex by vertex.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneTriangles {
    /// Positions \[m\].
    pub vertices: Vec<[f64; 3]>,
    /// Vertices of each triangle, from 0, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
    /// Pattern coordinates of fabric, one for each vertex, or those that `uv_faces` names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uv: Vec<[f64; 2]>,
    /// Of each corner of each triangle the pattern coordinate, from 0; not needed where each vertex has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub uv_faces: Vec<[u32; 3]>,
}
