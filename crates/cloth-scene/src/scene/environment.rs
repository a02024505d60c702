//! What acts on all cloths of a scene from outside.

use serde::{Deserialize, Serialize};

/// A force field.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneField {
    /// The same acceleration everywhere.
    Uniform {
        /// Acceleration \[m/s^2\].
        acceleration: [f64; 3],
    },
    /// A braking force against the velocity: a = -rate v.
    Drag {
        /// Rate for each axis \[1/s\].
        #[cfg_attr(test, schemars(inner(range(min = 0.0))))]
        rate: [f64; 3],
    },
    /// A force on each particle \[N\] as an expression of its position `x`, velocity `v`, mass `m`
    /// and index `id`, and of the time `t`: see [`FieldProgram`](cloth_core::FieldProgram).
    Expression(String),
    /// The same in the coordinates of FYSL, left handed with y up, for what the expression reads and
    /// for the force.
    #[serde(rename = "expression_left_handed")]
    ExpressionLeftHanded(String),
}

/// The air and its wind.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneWind {
    /// Velocity \[m/s\].
    pub velocity: [f64; 3],
    /// Density of the air \[kg/m^3\]; 1.204 if not given.
    #[serde(default = "density_default")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub density: f64,
    /// Gusts on top of the steady wind; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gust: Option<SceneGust>,
}

/// A wind that swells and dies down: its velocity is multiplied by
/// 1 + amplitude sin(2 pi frequency t).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneGust {
    /// Relative amplitude, dimensionless.
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub amplitude: f64,
    /// Frequency \[Hz\].
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub frequency: f64,
}

const fn density_default() -> f64 {
    1.204
}
