//! The driver of a model: frame by frame, under what comes from outside.

use std::sync::Arc;

#[cfg(feature = "io")]
use cloth_core::contact::{Contact, Contacts};
use cloth_core::{
    Backend, Control, Error, Frame, Model, Pose, Result, Solver, SolverConfig, State, StepReport,
};
#[cfg(feature = "io")]
use cloth_io::ContactFrame;

/// A model in progress. Frame 0 is the start; frame k is the state after k frames of equal length.
///
/// Nothing leaves the solver but what is asked for: [`Self::state`] and [`Self::normals`] fetch what the present
/// frame ended with, once, and a frame that nobody looks at stays where it is. After an error of the solver the
/// frames are at their end: whatever is asked for is answered with that error, except a state and normals of the last
/// good frame that were fetched before. [`Self::solver_mut`] is the way out, with a state to go on from.
///
/// ```
/// use cloth::{Cloth, Control, GridPatch, MaterialPreset, ModelBuilder, ModelSimulation};
/// use cloth::{ImplicitSettings, Integrator, SolverConfig, backend_create};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let patch = GridPatch::new([21, 21], 0.05);
/// let sheet = Cloth::grid("sheet", patch, &MaterialPreset::JERSEY).with_pins([0, 20]);
/// let model = ModelBuilder::new().cloth(sheet).build()?;
/// let integrator = Integrator::Implicit(ImplicitSettings::default());
/// let config = SolverConfig { integrator, time_step: 1.0 / 60.0, ..SolverConfig::default() };
/// let backend = backend_create("cpu", None)?;
/// let mut simulation = ModelSimulation::new(model, &config, 60.0, backend.as_ref())?;
/// for _ in 0..6 {
///     simulation.step(&Control::default())?;
/// }
/// assert!(simulation.state()?.positions[210][2] < -0.01, "the middle sinks");
/// # Ok(())
/// # }
/// ```
pub struct ModelSimulation<S: Solver = Box<dyn Solver>> {
    solver: S,
    frame_length: Frame,
    frame: u64,
    report: StepReport,
    state: Fetched<State>,
    normals: Fetched<Vec<[f64; 3]>>,
    failure: Option<Error>,
}

/// Where a contact is on its first feature, or on the second where that is a body's \[m\].
#[cfg(feature = "io")]
fn place_on_cloth(contact: &Contact, positions: &[[f64; 3]]) -> [f64; 3] {
    let is_own = |particle: u32| (particle as usize) < positions.len();
    let mut all = contact.particles.into_iter().zip(contact.weights);
    let is_first = all.any(|(particle, weight)| weight > 0.0 && is_own(particle));
    let mut place = [0.0; 3];
    for (particle, weight) in contact.particles.into_iter().zip(contact.weights) {
        let share = if is_first { weight.max(0.0) } else { (-weight).max(0.0) };
        if share > 0.0 && is_own(particle) {
            let x = positions[particle as usize];
            (0..3).for_each(|axis| place[axis] += share * x[axis]);
        }
    }
    place
}

/// What was read from the solver, and whether that is still the present frame.
#[derive(Default)]
struct Fetched<T> {
    value: T,
    is_current: bool,
}

impl ModelSimulation {
    /// Makes ready to run `model` from its start. All memory is taken here.
    ///
    /// # Errors
    /// What [`Backend::create_solver`] reports.
    pub fn new(
        model: impl Into<Arc<Model>>,
        config: &SolverConfig,
        frames_per_second: f64,
        backend: &dyn Backend,
    ) -> Result<Self> {
        let solver = backend.create_solver(model.into(), config)?;
        Ok(Self::of_solver(solver, frames_per_second))
    }
}

impl<S: Solver> ModelSimulation<S> {
    /// Goes on with a solver of any kind from the state that it has, which becomes frame 0: one whose kind is known
    /// can be asked for more than others, such as a `WgpuSolver` for its buffers.
    #[must_use]
    pub fn of_solver(solver: S, frames_per_second: f64) -> Self {
        Self {
            solver,
            frame_length: Frame::per_second(frames_per_second),
            frame: 0,
            report: StepReport::default(),
            state: Fetched::default(),
            normals: Fetched::default(),
            failure: None,
        }
    }

    /// Advances by one frame under a control, which holds until another one changes it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a control or a frame that makes no sense: nothing has happened then.
    /// [`Error::Diverged`] and what else [`Solver::synchronize`] reports.
    pub fn step(&mut self, control: &Control) -> Result<&StepReport> {
        self.step_by(|solver, frame| {
            solver.set_control(control)?;
            solver.advance(frame)?;
            solver.synchronize()
        })
    }

    /// Advances by one frame in the way that `advance` knows.
    pub(crate) fn step_by(
        &mut self,
        advance: impl FnOnce(&mut S, Frame) -> Result<StepReport>,
    ) -> Result<&StepReport> {
        self.check()?;
        match advance(&mut self.solver, self.frame_length) {
            Ok(report) => {
                self.report = report;
                self.frame += 1;
                self.state.is_current = false;
                self.normals.is_current = false;
                Ok(&self.report)
            }
            Err(refused @ Error::Invalid(_)) => Err(refused),
            Err(error) => {
                self.failure = Some(error.clone());
                Err(error)
            }
        }
    }

    fn check(&self) -> Result<()> {
        self.failure.clone().map_or(Ok(()), Err)
    }

    /// The state at the end of the present frame.
    ///
    /// # Errors
    /// What the device reports, or the error at which the frames came to their end.
    pub fn state(&mut self) -> Result<&State> {
        self.state_fetch()?;
        Ok(&self.state.value)
    }

    /// That state, if it has been read.
    #[cfg(feature = "scene")]
    pub(crate) fn state_known(&self) -> Option<&State> {
        self.state.is_current.then_some(&self.state.value)
    }

    fn state_fetch(&mut self) -> Result<()> {
        if !self.state.is_current {
            self.check()?;
            let state = &mut self.state.value;
            self.solver.download(state)?;
            self.state.is_current = true;
        }
        Ok(())
    }

    /// Unit normal of each particle at the end of the present frame, area weighted; zero for a particle without
    /// triangles.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn normals(&mut self) -> Result<&[[f64; 3]]> {
        self.normals_fetch()?;
        Ok(&self.normals.value)
    }

    /// The contacts between triangles at the end of the present frame, with where they are on the cloth. Where seams
    /// are welded particles are those of the panels.
    ///
    /// # Errors
    /// As [`Self::state`].
    #[cfg(feature = "io")]
    pub fn contacts(&mut self) -> Result<ContactFrame> {
        self.check()?;
        let mut found = Contacts::default();
        self.solver.contacts_read(&mut found)?;
        let contacts = found.contacts;
        let state = self.state()?;
        let places = contacts.iter().map(|contact| place_on_cloth(contact, &state.positions));
        Ok(ContactFrame { time: state.time, places: places.collect(), contacts })
    }

    fn normals_fetch(&mut self) -> Result<()> {
        if !self.normals.is_current {
            self.check()?;
            self.solver.normals(&mut self.normals.value)?;
            self.normals.is_current = true;
        }
        Ok(())
    }

    /// State and normals together, for writers of frames.
    ///
    /// # Errors
    /// As [`Self::state`].
    pub fn state_and_normals(&mut self) -> Result<(&State, &[[f64; 3]])> {
        self.state_fetch()?;
        self.normals_fetch()?;
        Ok((&self.state.value, &self.normals.value))
    }

    /// Poses of all colliders at the end of the present frame; known without asking the device.
    #[must_use]
    pub fn colliders(&self) -> &[Pose] {
        self.solver.colliders()
    }

    /// What the solver did in the last frame.
    #[must_use]
    pub const fn report(&self) -> &StepReport {
        &self.report
    }

    /// Number of the present frame: frames computed since the start.
    #[must_use]
    pub const fn frame(&self) -> u64 {
        self.frame
    }

    /// Counts from another number, for a state that is not that of the start.
    #[cfg(feature = "scene")]
    pub(crate) const fn frame_set(&mut self, frame: u64) {
        self.frame = frame;
    }

    /// Makes the solver ready for the next frame; `begin` returns whether particles moved.
    #[cfg(feature = "scene")]
    pub(crate) fn begin(&mut self, begin: impl FnOnce(&mut S, u64) -> Result<bool>) -> Result<()> {
        self.check()?;
        if begin(&mut self.solver, self.frame)? {
            self.state.is_current = false;
            self.normals.is_current = false;
        }
        Ok(())
    }

    /// The model that is simulated.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        self.solver.model()
    }

    /// The solver.
    #[must_use]
    pub const fn solver(&self) -> &S {
        &self.solver
    }

    /// The solver, to do with it whatever it can do: state and normals are fetched anew after that, also those of a
    /// frame that failed.
    pub fn solver_mut(&mut self) -> &mut S {
        self.state.is_current = false;
        self.normals.is_current = false;
        self.failure = None;
        &mut self.solver
    }
}
