//! What holds cloths to bodies and to each other, beside seams.

use serde::{Deserialize, Serialize};

use super::ScenePin;

/// Vertices of a cloth that are held where they are at the start, seen from the closest points of a collider, of a rigid body or of another cloth: a
/// waistband to a body, a parachute to its load, a button to the layer below.
///
/// To a collider they are held by force, or with a stiffness by springs that end at the places to which the collider carries them; these act at the middle of
/// each frame. To a rigid body springs hold them as well, which pull at both; none is stiffer than the mass of the body bears where it feels the cloth every 2 ms.
/// They need the implicit solver. To another cloth springs of that stiffness hold them, each to the corners of the triangle in which the closest point lies.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneAttachment {
    /// Name, unique among attachments and seams; `attachment`, `attachment 2`, `attachment 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// The cloth whose vertices are held; if not given, the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloth: Option<String>,
    /// The vertices.
    pub vertices: Vec<ScenePin>,
    /// Name of the collider, rigid body or cloth that holds them.
    pub to: String,
    /// Stiffness of the hold of each vertex \[N/m\]. Without it they cannot leave their places on a collider, and a rigid body holds them as fast as its mass
    /// bears; to a cloth it must be given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: Option<f64>,
    /// Damping of the hold of each vertex \[N s/m\]; to a collider that of the motion in space, 0 if not given, to a rigid body 2 ms times the stiffness if not given, to a cloth critical damping if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
    /// Attribute of the vertices of the mesh by which the stiffness of each hold is multiplied, as goals are painted from 0, free, to 1; 1 for all if not
    /// given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// How far from the closest point a vertex may be at the start \[m\]: one that is farther is a slip. 0.01 if not given.
    #[serde(default = "reach_default")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub reach: f64,
    /// When a collider or rigid body lets the vertices go \[s\]; never if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub release: Option<f64>,
}

const fn reach_default() -> f64 {
    0.01
}
