//! The common workload: a square patch that hangs or falls onto a sphere, at any size.

use std::num::NonZeroUsize;

use cloth::{
    Backend, Frame, Precision, Result, Solver, State, StepReport,
    scene::{BenchKind, CompileOptions, bench_scene},
};

/// Frames before measurements start; the cloth then touches the sphere.
pub const FRAMES_BEFORE: usize = 10;

/// Frames that are measured. Contact costs more the more the cloth folds, so that only equal
/// windows compare.
pub const FRAMES_MEASURED: usize = 60;

/// One size and kind of the workload.
#[derive(Clone, Copy, Debug)]
pub struct Workload {
    /// What holds the patch.
    pub kind: BenchKind,
    /// Particles along a side.
    pub side: u32,
    /// Whether self-contact is on.
    pub contact: bool,
    /// Precision of the solver.
    pub precision: Precision,
    /// Threads, or all there are.
    pub threads: Option<NonZeroUsize>,
}

impl Workload {
    /// In f32 on all threads.
    #[must_use]
    pub const fn new(kind: BenchKind, side: u32, contact: bool) -> Self {
        Self { kind, side, contact, precision: Precision::F32, threads: None }
    }

    /// Name of the scene, as the reference programs print it.
    #[must_use]
    pub const fn scene(&self) -> &'static str {
        match self.kind {
            BenchKind::Hang => "hang",
            BenchKind::Sphere => "sphere",
        }
    }

    /// Number of particles.
    #[must_use]
    pub fn particles(&self) -> u64 {
        u64::from(self.side) * u64::from(self.side)
    }

    /// A solver that has done the frames before the measured ones.
    ///
    /// # Errors
    /// What the backend reports.
    ///
    /// # Panics
    /// If the built-in scene does not compile, which its tests exclude.
    pub fn start(&self, backend: &dyn Backend) -> Result<RunningWorkload> {
        let compiled = bench_scene(self.kind, self.side, self.contact)
            .compile(&CompileOptions::default())
            .expect("the workload is a valid scene");
        let mut config = compiled.config.clone();
        config.precision = self.precision;
        config.threads = self.threads;
        let solver = backend.create_solver(compiled.model, &config)?;
        RunningWorkload::new(solver, Frame::per_second(compiled.frames_per_second), FRAMES_BEFORE)
    }
}

/// The workload inside its measured frames.
pub struct RunningWorkload {
    solver: Box<dyn Solver>,
    frame: Frame,
    state: State,
    done: usize,
}

impl RunningWorkload {
    /// A solver that is first run for `before` frames.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn new(mut solver: Box<dyn Solver>, frame: Frame, before: usize) -> Result<Self> {
        for _ in 0..before {
            solver.advance(frame)?;
            solver.synchronize()?;
        }
        let mut state = State::default();
        solver.download(&mut state)?;
        Ok(Self { solver, frame, state, done: 0 })
    }

    /// Goes back to the first measured frame if the last one is done. Not to be timed.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn rewind_if_done(&mut self) -> Result<()> {
        if self.done == FRAMES_MEASURED {
            self.solver.upload(&self.state)?;
            self.done = 0;
        }
        Ok(())
    }

    /// One frame, to its report.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn step(&mut self) -> Result<StepReport> {
        self.done += 1;
        self.solver.advance(self.frame)?;
        self.solver.synchronize()
    }

    /// The present state.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn state(&mut self) -> Result<State> {
        let mut state = State::default();
        self.solver.download(&mut state)?;
        Ok(state)
    }
}
