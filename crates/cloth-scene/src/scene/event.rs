//! What happens to pins in the course of time.

use serde::{Deserialize, Serialize};

use super::ScenePin;

/// Something that happens to pins of one cloth.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneEvent {
    /// Time \[s\]. Pins are released at the start of the first frame that does not start earlier.
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub time: f64,
    /// Name of the cloth.
    pub cloth: String,
    /// The pins; particles of a named set that are not pinned, or held by an event before, are passed over.
    pub pins: Vec<ScenePin>,
    /// What happens to them.
    pub action: SceneAction,
}

/// What happens to pins.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum SceneAction {
    /// They are let go.
    Release,
    /// They are held where they are, whether they were pins before or not: a hand takes hold of them.
    Hold,
    /// They move in a straight line at constant speed. Moves at the same time add up.
    Move {
        /// Way to go \[m\].
        offset: [f64; 3],
        /// Time it takes \[s\].
        #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
        duration: f64,
    },
}
