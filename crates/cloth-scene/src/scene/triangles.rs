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
}
