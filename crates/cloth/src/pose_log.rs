//! Where colliders were.

use std::sync::{Arc, PoisonError, RwLock};

use cloth_core::Pose;

/// Poses of all colliders, frame by frame; copies share their memory, so that a picture can be asked for
/// while the simulation goes on.
#[derive(Clone, Debug, Default)]
pub struct PoseLog(Arc<RwLock<Vec<Vec<Pose>>>>);

impl PoseLog {
    pub(crate) fn new(start: Vec<Pose>) -> Self {
        Self(Arc::new(RwLock::new(vec![start])))
    }

    pub(crate) fn push(&self, poses: &[Pose]) {
        self.0.write().unwrap_or_else(PoisonError::into_inner).push(poses.to_vec());
    }

    /// The poses of a frame since the start of this log; of the last one, for a later frame.
    #[must_use]
    pub fn at(&self, frame: usize) -> Vec<Pose> {
        let frames = self.0.read().unwrap_or_else(PoisonError::into_inner);
        frames.get(frame).or(frames.last()).cloned().unwrap_or_default()
    }
}
