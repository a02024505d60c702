//! Solvers of linear systems by themselves: iterations and time to what is asked, against the number of particles, stiffness, time step and
//! layers in contact, for each preconditioner and backend.

use std::{collections::HashMap, sync::Arc, time::Instant};

use cloth::{
    Kernels, LinearMethod, LinearOutcome, LinearSettings, LinearStart, LinearStop, LinearVector,
    Model, Preconditioner,
};
use cloth_benches::SheetWorkload;

use crate::{case::CaseError, engine::Engine, record::LinearRecord};

/// What is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Sweep {
    Particles,
    Stiffness,
    TimeStep,
    Layers,
}

impl Sweep {
    pub(crate) const ALL: [Self; 4] =
        [Self::Particles, Self::Stiffness, Self::TimeStep, Self::Layers];

    /// As results and plots have it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Particles => "particles",
            Self::Stiffness => "stiffness",
            Self::TimeStep => "time step [s]",
            Self::Layers => "layers in contact",
        }
    }
}

/// What a solve is to reach.
pub(crate) const GOALS: [(&str, LinearStop, f64); 3] = [
    ("energy to 1e-2", LinearStop::Energy, 1e-2),
    ("residual to 1e-3", LinearStop::Residual, 1e-3),
    ("residual to 1e-6", LinearStop::Residual, 1e-6),
];

/// Sides of sheets, where not the number of particles is varied as well.
const SIDES: [u32; 7] = [32, 64, 128, 256, 512, 1024, 2048];
const SIDE: u32 = 128;
const STIFFNESS: [f64; 7] = [1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4];
const STEPS: [f64; 5] = [1e-3, 3e-3, 1e-2, 3e-2, 1e-1];
const LAYERS: [u32; 4] = [2, 3, 6, 12];
/// The largest side for a processor, and for a GPU that is played by one.
const SIDE_PROCESSOR: u32 = 512;
const SIDE_EMULATED: u32 = 64;
/// A solve that is likely to take longer is left out \[s\].
const LONGEST: f64 = 10.0;
/// Solves are timed for so long at least \[s\], and so many of them at most.
const TIMED: f64 = 0.2;
const TIMES_MAX: usize = 9;
const ITERATIONS_MAX: u32 = 20_000;

/// The systems for an engine, with what is varied and how far.
pub(crate) fn systems(engine: &Engine) -> Vec<(Sweep, f64, SheetWorkload)> {
    let side_max = match (engine.is_emulated(), engine.is_asynchronous()) {
        (true, _) => SIDE_EMULATED,
        (_, false) => SIDE_PROCESSOR,
        _ => u32::MAX,
    };
    let side = SIDE.min(side_max);
    let mut systems = Vec::new();
    for side in SIDES.into_iter().filter(|&side| side <= side_max) {
        let workload = SheetWorkload::new(side);
        systems.push((Sweep::Particles, workload.particles() as f64, workload));
    }
    for stiffness in STIFFNESS {
        let workload = SheetWorkload { stiffness, ..SheetWorkload::new(side) };
        systems.push((Sweep::Stiffness, stiffness, workload));
    }
    for step in STEPS {
        systems.push((Sweep::TimeStep, step, SheetWorkload { step, ..SheetWorkload::new(side) }));
    }
    for layers in LAYERS {
        let workload = SheetWorkload { layers, ..SheetWorkload::new(side / 2) };
        systems.push((Sweep::Layers, f64::from(layers), workload));
    }
    systems
}

/// The preconditioners that fabric can have.
const PRECONDITIONERS: [Preconditioner; 3] =
    [Preconditioner::Diagonal, Preconditioner::Block, Preconditioner::Schwarz];

/// How long solves took, by sweep, preconditioner and goal: particles and seconds of the largest one.
pub(crate) type Known = HashMap<(Sweep, String, &'static str), (f64, f64)>;

/// Solves a system in every way that is not likely to take too long.
///
/// # Errors
/// What the backend reports.
pub(crate) fn measure(
    engine: &Engine,
    (sweep, x, workload): (Sweep, f64, SheetWorkload),
    known: &mut Known,
    found: &mut Vec<LinearRecord>,
) -> Result<(), CaseError> {
    let model: Arc<Model> = workload.model()?;
    let (mut kernels, plan) = workload.assemble(engine.backend(), &model, None)?;
    let particles = workload.particles() as f64;
    for preconditioner in PRECONDITIONERS {
        let name = preconditioner.to_string();
        // The first time tables are made that never change; a frame makes what there is outdated.
        kernels.preconditioner_build(preconditioner)?;
        // So are kernels, when they are first used.
        let first =
            LinearSettings { preconditioner, iterations_max: 2, ..LinearSettings::default() };
        kernels.conjugate_gradient(&first, LinearStart::Constraints)?;
        kernels.frame_begin(&plan)?;
        let start = Instant::now();
        kernels.preconditioner_build(preconditioner)?;
        // Waits for all that is on its way to a device.
        kernels.vector_dot(LinearVector::RightSide, LinearVector::RightSide)?;
        let build = start.elapsed().as_secs_f64();
        for (goal, stop, tolerance) in GOALS {
            let key = (sweep, name.clone(), goal);
            // Iterations grow with the side where nothing keeps them from it.
            let expected = known
                .get(&key)
                .map(|(count, seconds)| seconds * (particles / count).powf(1.5).max(1.0));
            if expected.is_some_and(|seconds| seconds > LONGEST) {
                continue;
            }
            let settings = LinearSettings {
                method: LinearMethod::ConjugateGradient,
                preconditioner,
                stop,
                tolerance,
                iterations_max: ITERATIONS_MAX,
                ..LinearSettings::default()
            };
            let (outcome, seconds) = timed(&mut *kernels, &settings)?;
            known.insert(key, (particles, seconds));
            found.push(LinearRecord {
                sweep: sweep.name().into(),
                x,
                particles: workload.particles(),
                backend: engine.name().into(),
                preconditioner: name.clone(),
                goal: goal.into(),
                iterations: outcome.iterations,
                is_reached: outcome.converged,
                build: 1e3 * build,
                solve: 1e3 * seconds,
            });
        }
    }
    Ok(())
}

/// The outcome of a solve, and the median of the seconds that it takes.
fn timed(
    kernels: &mut dyn Kernels,
    settings: &LinearSettings,
) -> Result<(LinearOutcome, f64), CaseError> {
    let mut times = Vec::new();
    let begin = Instant::now();
    loop {
        let start = Instant::now();
        let outcome = kernels.conjugate_gradient(settings, LinearStart::Constraints)?;
        times.push(start.elapsed().as_secs_f64());
        if outcome.restarted {
            // What was built is gone.
            kernels.preconditioner_build(settings.preconditioner)?;
        }
        let is_enough = begin.elapsed().as_secs_f64() > TIMED || times.len() == TIMES_MAX;
        if is_enough {
            return Ok((outcome, cloth_benches::median(&mut times)));
        }
    }
}
