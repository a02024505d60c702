//! The driver: from a compiled scene to its frames.

use std::sync::Arc;

use cloth_core::{
    Backend, ColliderControl, ColliderImpulse, Control, Error, Frame, Integrator, Model, PinAction,
    Pose, Result, Solver, State, StepReport,
};
use cloth_rigid::RigidWorld;
use cloth_scene::CompiledScene;

use crate::{Checkpoint, PoseLog};

/// Longest time that a body waits for the reaction of the cloth \[s\]. A body on a cloth is a mass on a
/// spring, and a force that comes late feeds its swing: this is a small part of its period.
const EXCHANGE_INTERVAL: f64 = 2e-3;

/// A scene in progress. Frame 0 is the start; frame k is the state after k frames, at the time
/// k / frames per second.
pub struct Simulation {
    scene: CompiledScene,
    solver: Box<dyn Solver>,
    frame: u64,
    state: State,
    normals: Vec<[f64; 3]>,
    report: StepReport,
    rigid: Option<RigidWorld>,
    impulses: Vec<ColliderImpulse>,
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
    /// [`Error::Unsupported`](crate::Error) for a scene with rigid bodies, whose velocities are not in
    /// a checkpoint.
    pub fn resume(
        scene: CompiledScene,
        backend: &dyn Backend,
        checkpoint: &Checkpoint,
    ) -> Result<Self> {
        if !scene.rigids.is_empty() {
            let feature = "continuing rigid bodies from a checkpoint".to_owned();
            return Err(Error::Unsupported { backend: backend.info().name, feature });
        }
        let mut solver = backend.create_solver(Arc::clone(&scene.model), &scene.config)?;
        solver.upload(&checkpoint.state)?;
        Self::with_state(scene, solver, checkpoint.frame, checkpoint.state.clone())
    }

    fn with_state(
        scene: CompiledScene,
        mut solver: Box<dyn Solver>,
        frame: u64,
        state: State,
    ) -> Result<Self> {
        let mut normals = Vec::new();
        solver.normals(&mut normals)?;
        let mut impulses = Vec::new();
        let rigid = if scene.rigids.is_empty() {
            None
        } else {
            // So that a backend that cannot take part says so before the first frame.
            solver.collider_impulses(&mut impulses)?;
            let own = scene.model.colliders().len() - scene.rigids.len();
            let colliders = &scene.model.colliders()[..own];
            let world = RigidWorld::new(&scene.rigids, colliders, scene.model.gravity()).and_then(
                |mut world| world.join(&scene.rigids, &scene.rigid_joints).map(|()| world),
            );
            // Compiling the scene has made the same world.
            Some(world.map_err(|error| Error::Unsupported {
                backend: "rigid body",
                feature: error.to_string(),
            })?)
        };
        let poses = PoseLog::new(state.colliders.clone());
        let report = StepReport::default();
        Ok(Self { scene, solver, frame, state, normals, report, rigid, impulses, poses })
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
    /// input that no scene knows of, such as a mouse. Checkpoints do not remember a wind set here.
    ///
    /// # Errors
    /// As [`Self::step`], and [`Error::Invalid`](crate::Error) for a control that makes no sense.
    pub fn step_with(&mut self, change: impl FnOnce(&mut Control)) -> Result<FrameOutcome<'_>> {
        let mut control = self.scene.timeline.control(self.frame);
        change(&mut control);
        let frame = Frame::per_second(self.scene.frames_per_second);
        if self.rigid.is_some() {
            self.step_rigid(frame, &control)?;
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

    /// Advances cloth and bodies together, in parts short enough that each feels the other in time.
    fn step_rigid(&mut self, frame: Frame, control: &Control) -> Result<()> {
        // The implicit integrator does not say what colliders do, so that there is nothing to wait for.
        let parts = match self.scene.config.integrator {
            Integrator::Implicit(_) => 1.0,
            _ => (frame.duration / EXCHANGE_INTERVAL).ceil().clamp(1.0, 1e4),
        };
        let part = Frame { duration: frame.duration / parts };
        let (mut substeps, mut wall_time) = (0, std::time::Duration::ZERO);
        for number in 1..=parts as u32 {
            let mut control = self.control_part(control, number, f64::from(number) / parts);
            self.rigid_advance(part, &mut control);
            self.solver.set_control(&control)?;
            self.solver.advance(part)?;
            self.report = self.solver.synchronize()?;
            self.rigid_react()?;
            substeps += self.report.substeps;
            wall_time += self.report.wall_time;
        }
        self.report.substeps = substeps;
        self.report.wall_time = wall_time;
        Ok(())
    }

    /// What holds for a part of a frame that ends at `fraction` of it: whatever moves is then that far
    /// on its way from where it was when the frame began.
    fn control_part(&self, control: &Control, number: u32, fraction: f64) -> Control {
        let mut part = control.clone();
        // Pins are held and released once.
        part.pins.retain(|pin| number == 1 || matches!(pin.action, PinAction::MoveTo(_)));
        for pin in &mut part.pins {
            let start = self.state.positions.get(pin.particle as usize);
            if let (PinAction::MoveTo(target), Some(start)) = (&mut pin.action, start) {
                *target = std::array::from_fn(|k| start[k] + fraction * (target[k] - start[k]));
            }
        }
        for collider in &mut part.colliders {
            if let Some(start) = self.state.colliders.get(collider.collider as usize) {
                collider.pose = start.interpolate(&collider.pose, fraction);
            }
        }
        part
    }

    /// Moves the rigid bodies, and lets the cloth feel them on their way.
    fn rigid_advance(&mut self, frame: Frame, control: &mut Control) {
        let Some(rigid) = &mut self.rigid else { return };
        let colliders = self.scene.model.colliders().len();
        let own = colliders - self.scene.rigids.len();
        let mut targets: Vec<Option<Pose>> = vec![None; own];
        for control in &control.colliders {
            if let Some(target) = targets.get_mut(control.collider as usize) {
                *target = Some(control.pose);
            }
        }
        rigid.advance(frame.duration, &targets);
        for (index, pose) in (own..colliders).zip(rigid.poses()) {
            control.colliders.push(ColliderControl { collider: index as u32, pose });
        }
    }

    /// Gives the bodies what the cloth took from them.
    fn rigid_react(&mut self) -> Result<()> {
        let Some(rigid) = &mut self.rigid else { return Ok(()) };
        self.solver.collider_impulses(&mut self.impulses)?;
        let own = self.scene.model.colliders().len() - self.scene.rigids.len();
        for (body, impulse) in self.impulses[own..].iter().enumerate() {
            rigid.apply(body, impulse);
        }
        Ok(())
    }

    /// The rigid bodies, if the scene has any.
    #[must_use]
    pub const fn rigid(&self) -> Option<&RigidWorld> {
        self.rigid.as_ref()
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
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            fingerprint: self.scene.model.fingerprint(),
            precision: self.scene.config.precision,
            frame: self.frame,
            state: self.state.clone(),
        }
    }
}
