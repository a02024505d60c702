//! The driver: from a compiled scene to its frames.

use std::sync::Arc;

use cloth_core::{Backend, Control, Error, Frame, Model, Result, Solver, State, StepReport};
use cloth_rigid::RigidWorld;
use cloth_scene::CompiledScene;

use crate::{Checkpoint, PoseLog, RigidExchange};

/// A scene in progress. Frame 0 is the start; frame k is the state after k frames, at the time
/// k / frames per second.
pub struct Simulation {
    scene: CompiledScene,
    solver: Box<dyn Solver>,
    frame: u64,
    state: State,
    normals: Vec<[f64; 3]>,
    report: StepReport,
    rigid: Option<RigidExchange>,
    poses: PoseLog,
}

/// A frame that was computed.
#[derive(Clone, Copy, Debug)]
pub struct FrameOutcome<'a> {
    /// Number of the frame; the first one computed is 1.
    pub frame: u64,
    /// What the solver did.
    pub report: &'a StepReport,
    /// The state at the end of the frame.
    pub state: &'a State,
    /// Unit normal of each particle in that state, zero for a particle without triangles.
    pub normals: &'a [[f64; 3]],
}

impl Simulation {
    /// Makes ready to run `scene` from its start. All memory is taken here.
    ///
    /// # Errors
    /// What [`Backend::create_solver`] and [`Solver::normals`] report.
    pub fn new(scene: CompiledScene, backend: &dyn Backend) -> Result<Self> {
        let solver = backend.create_solver(Arc::clone(&scene.model), &scene.config)?;
        let state = scene.model.initial_state();
        Self::with_state(scene, solver, 0, state)
    }

    /// Makes ready to continue `scene` from a checkpoint, as if there had been no interruption:
    /// frames have the same bits.
    ///
    /// # Errors
    /// As [`Self::new`], [`Error::Invalid`](crate::Error) if the state does not fit the model, and
    /// [`Error::Checkpoint`](crate::Error) if its rigid bodies are not those of the scene, or if it has none
    /// because an earlier version wrote it, which did not put down what is between them.
    pub fn resume(
        scene: CompiledScene,
        backend: &dyn Backend,
        checkpoint: &Checkpoint,
    ) -> Result<Self> {
        let refused = |reason| Err(Error::Checkpoint { reason });
        if scene.rigids.is_empty() && !checkpoint.rigid.is_empty() {
            return refused("it has rigid bodies, and the scene has none".into());
        }
        if !scene.rigids.is_empty() && checkpoint.rigid.is_empty() {
            let bodies = scene.rigids.len();
            return refused(format!(
                "the scene has {bodies} rigid bodies, and an earlier version of the program wrote it, which left out the contacts between them"
            ));
        }
        let mut solver = backend.create_solver(Arc::clone(&scene.model), &scene.config)?;
        solver.upload(&checkpoint.state)?;
        let state = checkpoint.state.clone();
        let mut simulation = Self::with_state(scene, solver, checkpoint.frame, state)?;
        if let Some(rigid) = &mut simulation.rigid {
            rigid
                .resume(&checkpoint.rigid)
                .map_err(|error| Error::Checkpoint { reason: error.to_string() })?;
        }
        Ok(simulation)
    }

    fn with_state(
        scene: CompiledScene,
        mut solver: Box<dyn Solver>,
        frame: u64,
        state: State,
    ) -> Result<Self> {
        let mut normals = Vec::new();
        solver.normals(&mut normals)?;
        let rigid = RigidExchange::new(&scene, solver.as_mut())?;
        let poses = PoseLog::new(frame, state.colliders.clone());
        let report = StepReport::default();
        Ok(Self { scene, solver, frame, state, normals, report, rigid, poses })
    }

    /// Advances by one frame, under the control that the scene has for it. Runs on past the last
    /// frame of the scene if it is called again.
    ///
    /// # Errors
    /// [`Error::Diverged`](crate::Error) and what else [`Solver::synchronize`] reports; the state
    /// that [`Self::state`] gives is then still that of the frame before.
    pub fn step(&mut self) -> Result<FrameOutcome<'_>> {
        self.step_with(|_| {})
    }

    /// Like [`Self::step`], after `change` to the control that the scene has for this frame: for
    /// input that no scene knows of, such as a mouse. Checkpoints do not remember wind and forces set here.
    ///
    /// # Errors
    /// As [`Self::step`], and [`Error::Invalid`](crate::Error) for a control that makes no sense.
    pub fn step_with(&mut self, change: impl FnOnce(&mut Control)) -> Result<FrameOutcome<'_>> {
        let mut control = self.scene.timeline.control(self.frame);
        change(&mut control);
        let frame = Frame::per_second(self.scene.frames_per_second);
        if let Some(rigid) = &mut self.rigid {
            self.report = rigid.step(self.solver.as_mut(), &control, frame)?;
        } else {
            self.solver.set_control(&control)?;
            self.solver.advance(frame)?;
            self.report = self.solver.synchronize()?;
        }
        self.solver.download(&mut self.state)?;
        self.solver.normals(&mut self.normals)?;
        self.poses.push(&self.state.colliders);
        self.frame += 1;
        Ok(FrameOutcome {
            frame: self.frame,
            report: &self.report,
            state: &self.state,
            normals: &self.normals,
        })
    }

    /// The rigid bodies, if the scene has any.
    #[must_use]
    pub fn rigid(&self) -> Option<&RigidWorld> {
        self.rigid.as_ref().map(RigidExchange::world)
    }

    /// Where all colliders were in each frame so far; goes on growing.
    #[must_use]
    pub fn poses(&self) -> PoseLog {
        self.poses.clone()
    }

    /// Number of the present frame: frames computed since the start of the scene.
    #[must_use]
    pub const fn frame(&self) -> u64 {
        self.frame
    }

    /// Whether all frames of the scene are computed.
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        self.frame >= self.scene.frames as u64
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &CompiledScene {
        &self.scene
    }

    /// The model that is simulated.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.scene.model
    }

    /// The state at the end of the present frame.
    #[must_use]
    pub const fn state(&self) -> &State {
        &self.state
    }

    /// Unit normals of the particles at the end of the present frame, as in [`FrameOutcome`].
    #[must_use]
    pub fn normals(&self) -> &[[f64; 3]] {
        &self.normals
    }

    /// All that is needed to continue from the present frame later.
    ///
    /// # Errors
    /// [`Error::Checkpoint`](crate::Error) if the state of the rigid bodies cannot be put down.
    pub fn checkpoint(&self) -> Result<Checkpoint> {
        let rigid = self.rigid().map_or_else(|| Ok(Vec::new()), RigidWorld::snapshot);
        Ok(Checkpoint {
            fingerprint: self.scene.model.fingerprint(),
            collider_fingerprint: Some(self.scene.model.collider_fingerprint()),
            precision: self.scene.config.precision,
            frame: self.frame,
            state: self.state.clone(),
            rigid: rigid.map_err(|error| Error::Checkpoint { reason: error.to_string() })?,
        })
    }
}
