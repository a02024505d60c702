//! The camera for pictures.

use serde::{Deserialize, Serialize};

/// A camera, upright with z up.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneView {
    /// Where the camera is \[m\].
    pub eye: [f64; 3],
    /// What it looks at \[m\].
    pub target: [f64; 3],
    /// Vertical field of view \[degrees\], above 0 and below 180; 40 if not given.
    #[serde(default = "field_of_view_default")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 180.0)))]
    pub field_of_view: f64,
}

const fn field_of_view_default() -> f64 {
    40.0
}
