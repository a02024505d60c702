//! Particles and springs without a surface.

use serde::{Deserialize, Serialize};

use super::SceneSpringClass;

/// Particles laid out on a logical grid of one to three dimensions, and springs between them.
///
/// Particle (i, j, k) of the grid has index (k height + j) width + i. There can be fewer particles than
/// the grid has places: the last ones then stay empty, and no spring leads there.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneNetwork {
    /// Places along the first axis.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub width: u32,
    /// Places along the second axis; 1 if not given.
    #[serde(default = "one")]
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub height: u32,
    /// Places along the third axis; 1 if not given.
    #[serde(default = "one")]
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub depth: u32,
    /// Positions of the particles \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Springs that repeat over the grid.
    #[serde(default, rename = "prototype", skip_serializing_if = "Vec::is_empty")]
    pub prototypes: Vec<ScenePrototype>,
    /// Single springs.
    #[serde(default, rename = "joint", skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<SceneJoint>,
}

/// A spring between each particle and its neighbours of one class: the next ones along the axes
/// (stretch), across the diagonals of the faces (shear), the next but one along the axes (bend).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePrototype {
    /// Class of the springs.
    pub class: SceneSpringClass,
    /// Stiffness \[N/m\]; that of the material if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: Option<f64>,
    /// Damping \[N s/m\]; that of the material if the stiffness is not given either, else 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
    /// Natural length \[m\]; the distance at the start if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub length: Option<f64>,
}

/// One spring.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneJoint {
    /// Index of one particle.
    pub from: u32,
    /// Index of the other.
    pub to: u32,
    /// Class of the spring.
    pub class: SceneSpringClass,
    /// Stiffness \[N/m\]; that of the material if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: Option<f64>,
    /// Damping \[N s/m\]; that of the material if the stiffness is not given either, else 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
    /// Natural length \[m\]; the distance at the start if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub length: Option<f64>,
}

const fn one() -> u32 {
    1
}
