//! Solid bodies that move by themselves.

use serde::{Deserialize, Serialize};

use super::{SceneColour, SceneRotation, SceneSolidMesh};

/// A rigid body, which gravity, its own force and torque, other bodies and the colliders move.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneRigid {
    /// Name, unique among bodies and colliders; `rigid`, `rigid 2`, `rigid 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// Shape in the local frame.
    pub shape: SceneRigidShape,
    /// Place of the local origin at the start \[m\].
    #[serde(default)]
    pub translation: [f64; 3],
    /// Rotation at the start; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Mass \[kg\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub mass: f64,
    /// Velocity at the start \[m/s\].
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Constant force on the centre of mass, beside gravity \[N\].
    #[serde(default)]
    pub force: [f64; 3],
    /// Centre of mass in the local frame \[m\]; that of the shape, evenly filled, if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_of_mass: Option<[f64; 3]>,
    /// Angular velocity at the start \[rad/s\].
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// Constant torque \[N m\].
    #[serde(default)]
    pub torque: [f64; 3],
    /// Coulomb friction coefficient, dimensionless; 0.3 if not given.
    #[serde(default = "friction_default")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub friction: f64,
    /// Coefficient of restitution, 0 (no rebound, the default) to 1 (elastic).
    #[serde(default)]
    #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
    pub restitution: f64,
    /// Whether pictures leave it out, as a drum around what is to be seen; false if not given. Cloth feels it all the same, and the camera sees where it is.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub hidden: bool,
    /// Colour in pictures; light grey if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<SceneColour>,
}

/// Shape of a rigid body in its local frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneRigidShape {
    /// A box around the local origin with faces across the local axes.
    Box {
        /// Half the side lengths \[m\].
        half_extents: [f64; 3],
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
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        half_length: f64,
        /// Radius \[m\].
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        radius: f64,
    },
    /// A closed triangle mesh.
    Mesh(SceneSolidMesh),
    /// A tetrahedron; either order of its vertices.
    Tetrahedron {
        /// Its corners \[m\].
        vertices: [[f64; 3]; 4],
    },
}

const fn friction_default() -> f64 {
    0.3
}

/// A constraint between two rigid bodies, as they are at the start. The two do not collide with each other.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneRigidJoint {
    /// What it leaves free.
    pub kind: SceneRigidJointKind,
    /// Name of a body.
    pub from: String,
    /// Name of the other one; the world if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Where they are joined \[m\].
    pub anchor: [f64; 3],
    /// Axis of a hinge or slider, of any length but zero.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// Least and largest angle \[degrees\] of a hinge, or way \[m\] of a slider, of `from` seen from `to`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[f64; 2]>,
}

/// What a joint leaves free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneRigidJointKind {
    /// Nothing.
    Fixed,
    /// All rotations about the anchor.
    Ball,
    /// The rotation about the axis.
    Hinge,
    /// The motion along the axis.
    Slider,
}
