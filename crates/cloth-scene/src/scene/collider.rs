//! Solid obstacles of a scene.

use serde::{Deserialize, Serialize};

use super::{SceneColour, SceneMannequin, SceneRotation, SceneSolidMesh};

/// An obstacle, at rest or moved by keyframes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneCollider {
    /// Name, unique among the colliders; `collider`, `collider 2`, `collider 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// Shape in the local frame.
    pub shape: SceneShape,
    /// Translation at the start \[m\]; none if not given.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Rotation at the start; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Coulomb friction coefficient, dimensionless; 0.3 if not given.
    #[serde(default = "friction_default")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub friction: f64,
    /// Coefficient of restitution, 0 (no rebound, the default) to 1 (elastic). Cloth in contact of triangles does not rebound.
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
    pub restitution: f64,
    /// Colour in pictures; light grey if not given. Planes have the pattern of a floor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<SceneColour>,
    /// Whether pictures leave it out, as a drum around what is to be seen; false if not given. Cloth feels it all the same, and the camera sees where it is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    /// Where it is later on, times ascending. Between keyframes it moves in a straight line and
    /// turns evenly, after the last one it rests.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub motion: Vec<SceneKeyframe>,
}

/// Shape of a collider in its local frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneShape {
    /// The half space on the side of the local origin that the normal points away from.
    Plane {
        /// Direction out of the solid, of any length but zero; (0, 0, 1) if not given.
        #[serde(default = "axis_z")]
        normal: [f64; 3],
    },
    /// A ball around the local origin.
    Sphere {
        /// Radius \[m\].
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        radius: f64,
    },
    /// All points within `radius` of a segment of the local z axis, centred on the origin.
    Capsule {
        /// Half the length of the segment \[m\].
        #[cfg_attr(test, schemars(range(min = 0.0)))]
        half_length: f64,
        /// Radius \[m\].
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        radius: f64,
    },
    /// A box around the local origin with faces across the local axes.
    Box {
        /// Half the side lengths \[m\].
        half_extents: [f64; 3],
    },
    /// A triangle mesh.
    Mesh(SceneSolidMesh),
    /// A mesh that changes its shape, from a file for each frame.
    Animation(SceneAnimation),
    /// A body of given measures.
    Mannequin(SceneMannequin),
    /// A tetrahedron, known in the same way; either order of its vertices.
    Tetrahedron {
        /// Its corners \[m\].
        vertices: [[f64; 3]; 4],
    },
}

/// A mesh that changes its shape, such as a body that walks: a file for each key frame, or one file and a point cache. All key frames have the same
/// faces, and other vertices. With contact of triangles vertices go in straight lines between two of them. Else holes are closed by a flat cap,
/// distances change linearly, and the surface moves along its normal with the velocity that follows from that. The last one holds from its time on.
/// Not beside rigid bodies, which would not feel it change.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneAnimation {
    /// The files, relative to the folder of the scene file, with `{}` in the place of the number; with a cache one file, whose vertices move.
    pub file: String,
    /// File with the positions of these vertices, a Point Cache 2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cache: Option<String>,
    /// Number of the first file, or of the first key frame of the cache, which count from 0; 0 if not given.
    #[serde(default)]
    pub first: u32,
    /// Number of key frames; all that follow in the cache if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 1, max = 10_000)))]
    pub frames: Option<u32>,
    /// File with the mesh at rest, such as a body with its arms spread, around which a garment is sewn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<String>,
    /// Time \[s\] in which the mesh at rest becomes that of the first key frame, in straight lines that begin and end at rest. It is rounded to whole
    /// key frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub blend: Option<f64>,
    /// When the mesh begins to move \[s\]; 0 if not given.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub start: f64,
    /// Thickness \[m\] of a skin around the mesh, which cloth feels and pictures do not show; 0 if not given. With contact of triangles vertices are
    /// moved along their normals by it, in pictures, too.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub skin: f64,
    /// Key frames for a second \[1/s\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub rate: f64,
    /// Samples of the distance along the longest side, 4 to 400; 64 if not given.
    #[serde(default = "cells_default")]
    #[cfg_attr(test, schemars(range(min = 4, max = 400)))]
    pub cells: u32,
    /// Factor on all coordinates, above zero; 1 if not given.
    #[serde(default = "one")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub scale: f64,
    /// Rotation about the origin of the mesh; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Translation of the mesh \[m\], before that of the collider; none if not given.
    #[serde(default)]
    pub translation: [f64; 3],
}

/// Where a collider is at one time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneKeyframe {
    /// Time \[s\], above zero: the pose at the start is that of the collider itself.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time: f64,
    /// Translation \[m\]; that of the keyframe before if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<[f64; 3]>,
    /// Rotation; that of the keyframe before if not given. Two rotations about the same axis lead
    /// from one angle to the other, through as many turns as the angles say; else the way is the
    /// shorter arc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
}

const fn cells_default() -> u32 {
    64
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

const fn one() -> f64 {
    1.0
}

const fn friction_default() -> f64 {
    0.3
}

const fn axis_z() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}
