//! What a run gives back in the language of its scene.

use std::path::{Path, PathBuf};

use cloth::{
    Simulation,
    scene::{
        Scene, SceneRotation,
        fysl::{FyslFeedback, FyslFrame, FyslTransform, FyslVertices},
    },
};

use crate::{
    arguments::RunArguments,
    failure::Failure,
    run_folder::{is_same_file, text_write},
};

/// A file that is not to be written over.
#[derive(Debug, thiserror::Error)]
#[error("`{}` {problem}; give --feedback another file", file.display())]
struct Kept {
    file: PathBuf,
    problem: &'static str,
}

/// Collects frames; empty if nobody asked for them.
pub(super) struct Feedback<'a> {
    file: Option<&'a Path>,
    frame_stride: u64,
    feedback: FyslFeedback,
}

impl<'a> Feedback<'a> {
    /// Feedback into the file that is asked for, which may replace one if that is asked for, too, but never `scene`.
    pub(super) fn new(arguments: &'a RunArguments, scene: Option<&Path>) -> Result<Self, Failure> {
        let file = arguments.feedback.as_deref();
        if let Some(file) = file {
            let kept = |problem| Failure::input(Kept { file: file.to_owned(), problem });
            if scene.is_some_and(|scene| is_same_file(file, scene)) {
                return Err(kept("is the scene itself, which is never written over"));
            }
            if file.exists() && !arguments.overwrite {
                return Err(kept("is there already, and only --overwrite replaces it"));
            }
        }
        let frame_stride = arguments.frame_stride.map_or(1, std::num::NonZeroUsize::get) as u64;
        Ok(Self { file, frame_stride, feedback: FyslFeedback::default() })
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
