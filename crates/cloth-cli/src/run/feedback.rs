//! What a run gives back in the language of its scene.

use std::path::Path;

use cloth::{
    Simulation,
    scene::{
        Scene, SceneRotation,
        fysl::{FyslFeedback, FyslFrame, FyslTransform, FyslVertices},
    },
};

use crate::{failure::Failure, run_folder::text_write};

/// Collects frames; empty if nobody asked for them.
pub(super) struct Feedback<'a> {
    file: Option<&'a Path>,
    frame_stride: u64,
    feedback: FyslFeedback,
}

impl<'a> Feedback<'a> {
    pub(super) fn new(file: Option<&'a Path>, frame_stride: usize) -> Self {
        Self { file, frame_stride: frame_stride as u64, feedback: FyslFeedback::default() }
    }

    /// Takes the present frame, unless it is passed over; the last one of the scene never is.
    ///
    /// # Errors
    /// What the device reports.
    pub(super) fn add(&mut self, simulation: &mut Simulation) -> Result<(), Failure> {
        let frame = simulation.frame();
        let counts = frame.is_multiple_of(self.frame_stride) || simulation.is_finished();
        if self.file.is_none() || frame == 0 || !counts {
            return Ok(());
        }
        let state = simulation.state()?.clone();
        let scene = simulation.scene();
        let groups = scene.model.cloths().iter().map(|cloth| {
            let particles = cloth.particles.start as usize..cloth.particles.end as usize;
            FyslVertices { name: cloth.name.clone(), vertices: state.positions[particles].to_vec() }
        });
        let own = state.colliders.len() - scene.rigids.len();
        let rigids = scene.rigids.iter().zip(&state.colliders[own..]).map(|(body, pose)| {
            let rotation = SceneRotation::from_quaternion(pose.rotation);
            FyslTransform { name: body.name.clone(), translation: pose.translation, rotation }
        });
        self.feedback.frames.push(FyslFrame {
            number: u32::try_from(frame).unwrap_or(u32::MAX),
            time: state.time,
            groups: groups.collect(),
            rigids: rigids.collect(),
        });
        Ok(())
    }

    /// Writes the file.
    pub(super) fn write(&self, scene: &Scene) -> Result<(), Failure> {
        match self.file {
            Some(file) => text_write(file, &scene.to_fysl_with(&self.feedback)?),
            None => Ok(()),
        }
    }
}
