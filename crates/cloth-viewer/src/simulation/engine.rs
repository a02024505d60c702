//! A scene in progress under the hand of a user.

mod past;
mod solver;

use std::{sync::Arc, time::Instant};

use cloth::{
    Control, ForceControl, Frame, PinAction, PinControl, Pose, RigidExchange, Solver, State,
    StepReport,
    io::{PictureSolid, PictureStyle},
    picture_shapes, picture_style,
    scene::{CompileOptions, CompiledScene, Scene},
};

use crate::{FrameBuffers, Gpu, Overlays, Ray, ViewerError, renderer::PlaceLine};

use self::{
    past::{Past, held_particles},
    solver::EngineSolver,
};
use super::{
    Settings, SettingsChange, Snapshot, contacts, corner_particles,
    grab::Grab,
    pick::{Pick, pick},
    pick_gpu::GpuPick,
    snapshot::{FramePool, GrabView, cell_side},
};

/// Part of the distance by which a ray may miss the cloth and still take hold of it.
const PICK_REACH: f64 = 0.02;

/// A scene in progress: everything that the window can do to it, and the frames that it gives back.
pub struct Engine {
    gpu: Gpu,
    scene: Scene,
    options: CompileOptions,
    /// The settings that it comes with.
    original: Settings,
    compiled: CompiledScene,
    style: PictureStyle,
    settings: Settings,
    solver: EngineSolver,
    /// The rigid bodies of the scene, if it has any.
    rigid: Option<RigidExchange>,
    frame: u64,
    time: f64,
    /// Substeps since the start.
    substeps: u64,
    /// The state on the host, as of the last time that it was asked for.
    state: State,
    state_is_current: bool,
    normals: Vec<[f64; 3]>,
    held: Vec<u8>,
    pins: Vec<PinControl>,
    grab: Option<Grab>,
    /// The springs of a hold that begins, or none at the end of one, for the next frame.
    forces: Option<Vec<ForceControl>>,
    /// What looks for particles on the device, once it is needed.
    picker: Option<GpuPick>,
    report: StepReport,
    duration: std::time::Duration,
    pool: FramePool,
    /// The frames that are kept, if they are to be.
    past: Option<Past>,
}

impl Engine {
    /// Makes ready to run `scene` from its start. With the backend `wgpu` it runs on the device that
    /// draws, and positions stay there; `auto` chooses.
    ///
    /// # Errors
    /// What is wrong with the scene, or what the backend cannot do.
    pub fn new(
        gpu: &Gpu,
        scene: Scene,
        options: CompileOptions,
        backend: &str,
    ) -> Result<Self, ViewerError> {
        let compiled = scene.compile(&options)?;
        let (mut solver, backend) = EngineSolver::choose(gpu, backend, &compiled)?;
        let rigid = RigidExchange::new(&compiled, solver.get())?;
        let state = compiled.model.initial_state();
        let settings = Settings::of_scene(&scene, &compiled, &backend);
        Ok(Self {
            gpu: gpu.clone(),
            original: settings.clone(),
            settings,
            style: picture_style(&compiled),
            compiled,
            scene,
            options,
            solver,
            rigid,
            frame: 0,
            time: 0.0,
            substeps: 0,
            held: state.held.clone(),
            state,
            state_is_current: true,
            normals: Vec::new(),
            pins: Vec::new(),
            grab: None,
            forces: None,
            picker: None,
            report: StepReport::default(),
            duration: std::time::Duration::ZERO,
            pool: FramePool::default(),
            past: None,
        })
    }

    /// The scene as it is compiled at present.
    #[must_use]
    pub const fn scene(&self) -> &CompiledScene {
        &self.compiled
    }

    /// How pictures of it look.
    #[must_use]
    pub const fn style(&self) -> &PictureStyle {
        &self.style
    }

    /// The settings in force.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Number of the present frame.
    #[must_use]
    pub const fn frame(&self) -> u64 {
        self.frame
    }

    /// What the solver did in the last frame.
    #[must_use]
    pub const fn report(&self) -> &StepReport {
        &self.report
    }

    /// The present state, fetched from the device if it is there.
    ///
    /// # Errors
    /// What the device reports.
    pub fn state(&mut self) -> Result<&State, ViewerError> {
        if !self.state_is_current {
            self.solver.get().download(&mut self.state)?;
            self.state_is_current = true;
        }
        Ok(&self.state)
    }

    /// Advances by one frame. After an error the scene is back at the last frame that is kept, or at its start.
    ///
    /// # Errors
    /// What the solver reports, such as a divergence.
    pub fn step(&mut self) -> Result<(), ViewerError> {
        let start = Instant::now();
        let frame = Frame::per_second(self.compiled.frames_per_second);
        let control = self.control(frame);
        self.state_is_current = false;
        match self.advance(&control, frame) {
            Ok(report) => self.report = report,
            Err(error) => {
                self.retreat()?;
                return Err(error);
            }
        }
        self.frame += 1;
        self.time = self.report.time;
        self.substeps += u64::from(self.report.substeps);
        self.duration = start.elapsed();
        self.keep()
    }

    fn control(&mut self, frame: Frame) -> Control {
        let mut control = self.compiled.timeline.control(self.frame);
        control.pins.append(&mut self.pins);
        for pin in &control.pins {
            let held = !matches!(pin.action, PinAction::Release);
            self.held[pin.particle as usize] = u8::from(held);
        }
        control.wind_velocity = self.settings.air.map(|air| air.velocity);
        let grab = self.grab.as_mut();
        let own = self.forces.take();
        if let Some(forces) = &mut control.forces {
            // The scene gives its own anew for each frame, which an offset of all anchors must not move.
            forces.extend(grab.into_iter().flat_map(|grab| grab.springs_along(frame.duration)));
        } else {
            control.forces = own;
            control.anchor_offset = grab.map(|grab| grab.follow(frame.duration));
        }
        control
    }

    /// Cloth and bodies for a frame.
    fn advance(&mut self, control: &Control, frame: Frame) -> Result<StepReport, ViewerError> {
        self.solver.begin(self.frame)?;
        let solver = self.solver.get();
        if let Some(rigid) = &mut self.rigid {
            return Ok(rigid.step(solver, control, frame)?);
        }
        solver.set_control(control)?;
        solver.advance(frame)?;
        Ok(solver.synchronize()?)
    }

    /// Back to the start of the scene, with its pins; settings stay.
    ///
    /// # Errors
    /// What the device reports.
    pub fn reset(&mut self) -> Result<(), ViewerError> {
        self.state = self.compiled.model.initial_state();
        self.solver.restore((0, &self.state), &Default::default())?;
        self.rigid = RigidExchange::new(&self.compiled, self.solver.get())?;
        self.held.clone_from(&self.state.held);
        self.state_is_current = true;
        self.frame = 0;
        self.time = 0.0;
        self.substeps = 0;
        self.pins.clear();
        self.grab_end();
        self.report = StepReport::default();
        self.past_clear();
        self.keep()
    }

    /// Holds a particle where it is, or lets it go, from the next frame on; whether it is held then.
    pub fn pin_toggle(&mut self, particle: u32) -> bool {
        let Some(held) = self.held.get_mut(particle as usize) else { return false };
        *held ^= 1;
        let action = if *held == 1 { PinAction::Hold } else { PinAction::Release };
        self.pins.push(PinControl { particle, action });
        *held == 1
    }

    /// [`Self::pin_toggle`] for one of the corners 0 to 3.
    pub fn corner_toggle(&mut self, corner: usize) -> bool {
        match corner_particles(&self.compiled).get(corner) {
            Some(&particle) => self.pin_toggle(particle),
            None => false,
        }
    }

    /// Whether a particle is held, or will be from the next frame on.
    #[must_use]
    pub fn is_held(&self, particle: u32) -> bool {
        self.held.get(particle as usize) == Some(&1)
    }

    /// The particle that a ray meets.
    ///
    /// # Errors
    /// What the device reports.
    pub fn pick(&mut self, ray: &Ray) -> Result<Option<u32>, ViewerError> {
        Ok(self.meet(ray)?.map(|pick| pick.particle))
    }

    /// What a ray meets: looked for where the positions are.
    fn meet(&mut self, ray: &Ray) -> Result<Option<Pick>, ViewerError> {
        if let EngineSolver::Shared(solver) = &mut self.solver {
            let buffers = solver.device_buffers()?;
            let (gpu, model) = (&self.gpu, &self.compiled.model);
            let picker = self.picker.get_or_insert_with(|| GpuPick::new(gpu, model));
            return picker.pick(&buffers.positions, ray, PICK_REACH);
        }
        self.state()?;
        Ok(pick(&self.compiled.model, &self.state.positions, ray, PICK_REACH))
    }

    /// Takes hold of the cloth where a ray meets it; the particle, if it meets one.
    ///
    /// # Errors
    /// What the device reports.
    pub fn grab_begin(&mut self, ray: &Ray) -> Result<Option<u32>, ViewerError> {
        self.grab_end();
        let Some(pick) = self.meet(ray)? else { return Ok(None) };
        let scene_pulls = self.compiled.timeline.control(self.frame).forces.is_some();
        let grab = match scene_pulls {
            true => {
                self.state()?;
                Grab::new(&self.compiled.model, ray, pick).with_anchors(&self.state.positions)
            }
            false => Grab::new(&self.compiled.model, ray, pick),
        };
        self.forces = Some(grab.springs().to_vec());
        self.grab = Some(grab);
        Ok(Some(pick.particle))
    }

    /// Pulls what is held to where a ray points, at the distance at which it was taken.
    pub fn grab_move(&mut self, ray: &Ray) {
        if let Some(grab) = &mut self.grab {
            grab.pointer_move(ray);
        }
    }

    /// Lets go.
    pub fn grab_end(&mut self) {
        if self.grab.take().is_some() {
            self.forces = Some(Vec::new());
        }
    }

    /// The scene as it comes, under the settings in force.
    #[must_use]
    pub fn scene_present(&self) -> Scene {
        self.settings.apply(&self.scene, &self.original)
    }

    /// Changes the settings: those that the model allows from the next frame on, others by a new
    /// solver that takes over the state, which is fetched for that; what is held is let go then. Another integrator comes with the
    /// time step that the scene has for it, unless that is changed too. After an error nothing has changed.
    ///
    /// # Errors
    /// What the scene or the backend cannot do.
    pub fn apply(&mut self, settings: &Settings) -> Result<SettingsChange, ViewerError> {
        let mut settings = settings.clone();
        let old = &self.settings;
        if settings.solver != old.solver && settings.time_step == old.time_step {
            let mut scene = self.scene.clone();
            scene.simulation.solver = Some(settings.solver);
            settings.time_step = scene.compile(&self.options)?.config.time_step;
        }
        let change = old.change_to(&settings);
        if change == SettingsChange::Rebuilt {
            self.rebuild(&settings)?;
        }
        self.settings = settings;
        Ok(change)
    }

    /// A new solver for these settings, with the state of the old one.
    fn rebuild(&mut self, settings: &Settings) -> Result<(), ViewerError> {
        let scene = settings.apply(&self.scene, &self.original);
        let compiled = scene.compile(&self.options)?;
        self.gpu.backend().stage_times_set(settings.stage_times);
        let mut solver = EngineSolver::new(&self.gpu, &settings.backend, &compiled)?;
        self.state()?;
        // Halvings count from the time step of the old settings.
        let state = State { time_step_halvings: 0, time_step_good: 0, ..self.state.clone() };
        solver.restore((self.frame, &state), &self.solver.gone())?;
        let mut rigid = RigidExchange::new(&compiled, solver.get())?;
        if let (Some(rigid), Some(old)) = (&mut rigid, &self.rigid) {
            rigid.motions_take(&state.colliders, &old.world().motions());
        }
        self.substeps = state.step;
        self.state = state;
        self.compiled = compiled;
        self.solver = solver;
        self.rigid = rigid;
        self.grab = None;
        self.forces = None;
        Ok(())
    }

    /// The present frame for the window. With the backend `wgpu` it is copied on the device, and positions stay there unless contacts
    /// or cells are asked for, which are found on the host.
    ///
    /// # Errors
    /// What the device reports.
    pub fn snapshot(&mut self, overlays: Overlays) -> Result<Snapshot, ViewerError> {
        let buffers = self.buffers()?;
        let (found, bins) = if overlays.contacts || overlays.bins {
            self.state()?;
            self.found(&self.state, overlays)
        } else {
            Default::default()
        };
        let grab = match self.grab.as_ref().map(|grab| (grab.particle, grab.target)) {
            Some((particle, target)) => {
                let is_known = matches!(self.solver, EngineSolver::Other(_));
                let position = match is_known {
                    true => self.state()?.positions.get(particle as usize).copied(),
                    false => None,
                };
                Some(GrabView { particle, position, target })
            }
            None => None,
        };
        let colliders = self.solver.get().colliders().to_vec();
        let shapes = self.shapes_at(&colliders, self.time);
        Ok(Snapshot {
            frame: self.frame,
            time: self.time,
            buffers,
            shapes,
            dust: self.style.dust.at(self.time),
            held: held_particles(&self.held),
            contacts: found,
            bins,
            grab,
            report: self.report.clone(),
            duration: self.duration,
            real_time_factor: 0.0,
            paused: false,
            recorded: None,
            kept: self.kept(),
            is_past: false,
        })
    }

    /// Buffers with the present positions and normals.
    fn buffers(&mut self) -> Result<Arc<FrameBuffers>, ViewerError> {
        // A frame that is kept on the device is there already.
        if let Some(buffers) = self.past_frame(self.frame).and_then(|frame| frame.buffers()) {
            return Ok(Arc::clone(buffers));
        }
        let buffers = self.pool.take(&self.gpu, self.compiled.model.particle_count());
        match &mut self.solver {
            EngineSolver::Shared(solver) => buffers.copy(&solver.device_buffers()?),
            EngineSolver::Other(solver) => {
                solver.normals(&mut self.normals)?;
                self.state()?;
                buffers.upload(&self.gpu, &self.state.positions, &self.normals);
            }
        }
        Ok(buffers)
    }

    /// Particles in contact and edges of occupied cells, as far as they are asked for.
    fn found(&self, state: &State, overlays: Overlays) -> (Vec<u32>, Vec<PlaceLine>) {
        let model = &self.compiled.model;
        let contacts = overlays.contacts.then(|| contacts::contact_particles(model, state));
        let bins = overlays.bins.then(|| contacts::bin_lines(&state.positions, cell_side(model)));
        (contacts.unwrap_or_default(), bins.unwrap_or_default())
    }

    /// The colliders at these poses; without bodies they are where the scene says.
    fn shapes_at(&self, colliders: &[Pose], time: f64) -> Vec<PictureSolid> {
        if self.rigid.is_some() {
            picture_shapes(&self.compiled, colliders, time)
        } else {
            self.style.shapes.at(time)
        }
    }
}
