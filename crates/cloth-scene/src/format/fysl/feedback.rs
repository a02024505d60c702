//! What the engine writes beside a scene: where everything was.

use serde::{Deserialize, Serialize};

use crate::{SceneError, SceneRotation};

use super::read;

/// The frames of a run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct FyslFeedback {
    /// The frames, in order.
    #[serde(default, rename = "frame")]
    pub frames: Vec<FyslFrame>,
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct FyslFrame {
    /// Its number; the start is frame 0.
    pub number: u32,
    /// Simulated time \[s\].
    pub time: f64,
    /// The particles of each group.
    #[serde(default, rename = "group")]
    pub groups: Vec<FyslVertices>,
    /// The rigid bodies.
    #[serde(default, rename = "rigid")]
    pub rigids: Vec<FyslTransform>,
}

/// The particles of a group.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct FyslVertices {
    /// Name of the group.
    pub name: String,
    /// Positions \[m\], in the coordinates of the engine.
    pub vertices: Vec<[f64; 3]>,
}

/// Where a rigid body is, in the coordinates of the engine.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct FyslTransform {
    /// Name of the body.
    pub name: String,
    /// Place of its local origin \[m\].
    pub translation: [f64; 3],
    /// Its rotation.
    pub rotation: SceneRotation,
}

impl FyslFeedback {
    /// The feedback in FYSL text; none if the text has none. `file` is its name in messages.
    ///
    /// # Errors
    /// As [`Scene::from_fysl`](crate::Scene::from_fysl).
    pub fn from_fysl(text: &str, file: &str) -> Result<Self, SceneError> {
        let feedback = read::tables(text, file)?.feedback;
        Self::deserialize(feedback).map_err(|error| SceneError::Syntax {
            place: crate::ScenePlace { file: file.into(), position: Some((1, 1)) },
            problem: error.message().trim_end().replace('\n', ", "),
        })
    }
}
