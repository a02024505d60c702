//! The driver of a scene: from what was compiled to its frames.

use std::sync::Arc;

use cloth_audit::Intersections;
use cloth_core::{
    Audit, Backend, Control, Error, Model, Pose, Result, SeamRange, Solver, State, StepReport,
    divergence_origin,
};
use cloth_io::ContactFrame;
use cloth_rigid::RigidWorld;
use cloth_scene::CompiledScene;

use crate::{Checkpoint, ModelSimulation, RigidExchange, SceneAudit, StagedSolver, staged::Stage};

/// How far sewing is.
#[derive(Clone, Debug, PartialEq)]
pub struct SeamReport {
    /// Whether all seams are welded that are to be.
    pub is_welded: bool,
    /// How many stitches are welded.
    pub welded: usize,
    /// The name of the seam with the widest stitch.
    pub seam: String,
    /// How wide that is, or how much wider than it is to be \[m\].
    pub gap: f64,
    /// Where it is \[m\].
    pub place: [f64; 3],
    /// How many stitches are broken.
    pub broken: usize,
}

/// A scene in progress. Frame 0 is the start; frame k is the state after k frames, at the time
/// k / frames per second. As [`ModelSimulation`] it fetches what is asked for, and nothing else.
pub struct Simulation<S: Solver = Box<dyn Solver>> {
    run: ModelSimulation<StagedSolver<S>>,
    rigid: Option<RigidExchange>,
}

impl Simulation {
    /// Makes ready to run `scene` from its start. All memory is taken here.
    ///
    /// # Errors
    /// What [`Backend::create_solver`] and [`Solver::collider_impulses`] report.
    pub fn new(scene: CompiledScene, backend: &dyn Backend) -> Result<Self> {
        Self::of_staged(StagedSolver::new(scene, backend)?)
    }

    /// Makes ready to run `scene` from another state than its own at the start, such as [`Checkpoint::read_start`] gives: a garment that was draped in
    /// another run. If its seams are welded in that state they are here, and what is torn there is.
    ///
    /// # Errors
    /// As [`Self::new`], and [`Error::Invalid`](crate::Error) if the state does not fit the model.
    pub fn start_from(scene: CompiledScene, backend: &dyn Backend, state: &State) -> Result<Self> {
        let torn = scene.model.tears().open_in(&state.positions);
        let solver = StagedSolver::at_state(scene, backend, (0, state), (&[], &torn))?;
        let mut simulation = Self::of_staged(solver)?;
        simulation.run.solver_mut().upload(state)?;
        Ok(simulation)
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
        let gone = (&checkpoint.broken[..], &checkpoint.torn[..]);
        let at = (checkpoint.frame, &checkpoint.state);
        let mut simulation = Self::of_staged(StagedSolver::at_state(scene, backend, at, gone)?)?;
        simulation.run.solver_mut().upload(&checkpoint.state)?;
        simulation.run.frame_set(checkpoint.frame);
        if let Some(rigid) = &mut simulation.rigid {
            rigid
                .resume(&checkpoint.rigid)
                .map_err(|error| Error::Checkpoint { reason: error.to_string() })?;
        }
        Ok(simulation)
    }
}

impl<S: Solver> Simulation<S> {
    /// Runs `scene` with a solver of its model that was made elsewhere, and is at its start: one whose kind is known
    /// can be asked for more than others, such as a `WgpuSolver` for its buffers.
    ///
    /// # Errors
    /// What [`Solver::collider_impulses`] reports.
    pub fn of_solver(scene: CompiledScene, solver: S) -> Result<Self> {
        Self::of_staged(StagedSolver::of_solver(scene, solver))
    }

    fn of_staged(mut solver: StagedSolver<S>) -> Result<Self> {
        let scene = solver.scene().clone();
        let rigid = RigidExchange::new(&scene, &mut solver)?;
        let run = ModelSimulation::of_solver(solver, scene.frames_per_second);
        Ok(Self { run, rigid })
    }

    /// Advances by one frame, under the control that the scene has for it. Runs on past the last
    /// frame of the scene if it is called again.
    ///
    /// # Errors
    /// As [`ModelSimulation::step`].
    pub fn step(&mut self) -> Result<&StepReport> {
        self.step_with(|_| {})
    }

    /// Like [`Self::step`], after `change` to the control that the scene has for this frame: for
    /// input that no scene knows of, such as a mouse. Checkpoints do not remember wind and forces set here.
    ///
    /// # Errors
    /// As [`Self::step`], and [`Error::Invalid`](crate::Error) for a control that makes no sense.
    pub fn step_with(&mut self, change: impl FnOnce(&mut Control)) -> Result<&StepReport> {
        self.run.begin(StagedSolver::begin)?;
        let mut control = self.scene().timeline.control(self.run.frame());
        change(&mut control);
        let outcome = match &mut self.rigid {
            Some(rigid) => self.run.step_by(|solver, frame| rigid.step(solver, &control, frame)),
            None => self.run.step(&control),
        };
        match outcome.err() {
            None => Ok(self.run.report()),
            Some(error) => Err(self.explained(error)),
        }
    }

    fn stage(&self) -> &Stage {
        self.run.solver().stage()
    }

    /// Number of edges that are torn at the end of the present frame.
    #[must_use]
    pub fn torn_edges(&self) -> usize {
        self.stage().torn().len()
    }

    /// Whether all seams are welded that are to be, and the widest stitch of each seam \[m\] at the end of the present frame.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn seams(&mut self) -> Result<(bool, Vec<f64>)> {
        let model = Arc::clone(self.model());
        let welded = self.stage().is_sewn();
        Ok((welded, model.seams().gaps(&self.run.state()?.positions)))
    }

    /// How far sewing is at the end of the present frame, if the scene has seams.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn seam_report(&mut self) -> Result<Option<SeamReport>> {
        if self.scene().model.seams().is_empty() {
            return Ok(None);
        }
        let model = Arc::clone(self.model());
        let is_welded = self.stage().is_sewn();
        let broken = self.stage().broken().to_vec();
        let welded = self.stage().welded(self.scene());
        let positions = &self.run.state()?.positions;
        let seams = model.seams();
        let holds = |stitch: usize| broken.binary_search(&(stitch as u32)).is_err();
        Ok(seams.widest(positions, holds).map(|(stitch, gap)| {
            let [particle, _] = seams.stitches()[stitch];
            let of = |seam: &&SeamRange| seam.stitches.contains(&(stitch as u32));
            let seam = seams.ranges().iter().find(of);
            SeamReport {
                is_welded,
                welded,
                seam: seam.map(|seam| seam.name.clone()).unwrap_or_default(),
                gap,
                place: positions.get(particle as usize).copied().unwrap_or_default(),
                broken: broken.len(),
            }
        }))
    }

    /// The error with what made the simulation diverge, if the state before the frame is known and tells.
    fn explained(&self, error: Error) -> Error {
        let Error::Diverged(mut divergence) = error else { return error };
        let start = || (self.frame() == 0).then(|| self.scene().model.initial_state());
        if let Some(state) = self.run.state_known().cloned().or_else(start) {
            let (time, time_step) = (divergence.time, divergence.time_step);
            divergence.origin = divergence_origin(&self.scene().model, &state, time, time_step);
        }
        Error::Diverged(divergence)
    }

    /// How cloth lies at the end of the present frame.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn audit(&mut self) -> Result<Audit> {
        // Folds are between particles that are one.
        let weld = self.stage().weld().filter(|_| !self.scene().model.tears().is_empty());
        if let Some(weld) = weld.cloned() {
            let model = Arc::clone(self.model());
            let state = weld.contract(model.masses(), self.run.state()?);
            return Ok(Audit::new(&weld.model, &state.positions));
        }
        let model = Arc::clone(self.model());
        Ok(Audit::new(&model, &self.run.state()?.positions))
    }

    /// Counts the triangles that intersect at the end of the present frame, in the precision of the solver.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn intersections(&mut self, audit: &SceneAudit) -> Result<Intersections> {
        let state = self.run.state()?;
        Ok(audit.at(&state.positions, &state.colliders, state.time))
    }

    /// The rigid bodies, if the scene has any.
    #[must_use]
    pub fn rigid(&self) -> Option<&RigidWorld> {
        self.rigid.as_ref().map(RigidExchange::world)
    }

    /// Poses of all colliders at the end of the present frame; known without asking the device.
    #[must_use]
    pub fn colliders(&self) -> &[Pose] {
        self.run.colliders()
    }

    /// Number of the present frame: frames computed since the start of the scene.
    #[must_use]
    pub const fn frame(&self) -> u64 {
        self.run.frame()
    }

    /// Whether all frames of the scene are computed.
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        self.frame() >= self.scene().frames as u64
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &CompiledScene {
        self.run.solver().scene()
    }

    /// The model that is simulated.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        &self.scene().model
    }

    /// What the solver did in the last frame.
    #[must_use]
    pub const fn report(&self) -> &StepReport {
        self.run.report()
    }

    /// The state at the end of the present frame.
    ///
    /// # Errors
    /// What the device reports, or the error at which the frames came to their end.
    pub fn state(&mut self) -> Result<&State> {
        self.run.state()
    }

    /// Unit normals of the particles at the end of the present frame, as in [`ModelSimulation::normals`].
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn normals(&mut self) -> Result<&[[f64; 3]]> {
        self.run.normals()
    }

    /// The contacts between triangles at the end of the present frame, as in [`ModelSimulation::contacts`].
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn contacts(&mut self) -> Result<ContactFrame> {
        self.run.contacts()
    }

    /// State and normals together, for writers of frames.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn state_and_normals(&mut self) -> Result<(&State, &[[f64; 3]])> {
        self.run.state_and_normals()
    }

    /// The solver of what is simulated at present.
    #[must_use]
    pub const fn solver(&self) -> &S {
        self.run.solver().inner()
    }

    /// That solver, as [`ModelSimulation::solver_mut`] gives it. Rigid bodies do not follow a state that is uploaded.
    pub fn solver_mut(&mut self) -> &mut S {
        self.run.solver_mut().inner_mut()
    }

    /// All that is needed to continue from the present frame later.
    ///
    /// # Errors
    /// As [`Self::state`], and [`Error::Checkpoint`](crate::Error) if the state of the rigid bodies cannot be put down.
    pub fn checkpoint(&mut self) -> Result<Checkpoint> {
        let rigid = self.rigid().map_or_else(|| Ok(Vec::new()), RigidWorld::snapshot);
        Ok(Checkpoint {
            fingerprint: self.scene().model.fingerprint(),
            collider_fingerprint: Some(self.scene().model.collider_fingerprint()),
            precision: self.scene().config.precision,
            frame: self.run.frame(),
            state: self.run.state()?.clone(),
            broken: self.stage().broken().to_vec(),
            torn: self.stage().torn().to_vec(),
            rigid: rigid.map_err(|error| Error::Checkpoint { reason: error.to_string() })?,
        })
    }
}
