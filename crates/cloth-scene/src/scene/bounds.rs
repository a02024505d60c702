//! The part of space that a scene is about.

use serde::{Deserialize, Serialize};

/// A box along the axes. It bounds what pictures show of a scene without a camera, not the motion.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneBounds {
    /// Corner with the smallest coordinates \[m\].
    pub min: [f64; 3],
    /// Corner with the largest coordinates \[m\].
    pub max: [f64; 3],
}
