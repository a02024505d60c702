//! Running a case and taking its time.

use std::time::Instant;

use cloth::{Backend, Solver, State, StepReport};

use crate::{
    case::{Case, CaseError},
    check,
    engine::{DeviceClock, Engine},
    memory::MemoryMark,
    record::{Quality, Record, Statistics, Verdict},
};

/// Stages that are there for the report alone.
const STAGE_MEASURE: &str = "measure";

/// Runs a case on an engine and compares its result with that of the reference.
///
/// # Errors
/// What the model or a backend reports.
pub(crate) fn measure(
    engine: &Engine,
    reference: &dyn Backend,
    case: &Case,
) -> Result<Record, CaseError> {
    let model = case.model()?;
    let mark = MemoryMark::now(engine);
    let start = Instant::now();
    let mut solver = engine.backend().create_solver(model.clone(), &case.config)?;
    step(&mut *solver, case)?;
    let first_frame = milliseconds(start);
    for _ in 1..case.frames[0] {
        step(&mut *solver, case)?;
    }
    let mut state = State::default();
    solver.download(&mut state)?;
    let frames = Frames::run(&mut *solver, case)?;
    let particles = model.particle_count() as f64;
    let (memory_host, memory_device) = mark.since(engine);
    let in_a_row = if engine.is_asynchronous() {
        Some(frames_in_a_row(&mut *solver, case, &state)?)
    } else {
        None
    };
    let (difference, verdict) = check::check(
        reference,
        model.clone(),
        &case.config,
        case.frame,
        &mut *solver,
        case.spacing(),
    )?;
    drop(solver);
    let timed = match engine.device_clock() {
        DeviceClock::None => None,
        DeviceClock::EveryRun => Some(&frames),
        DeviceClock::SecondRun(backend) => {
            let mut solver = backend.create_solver(model, &case.config)?;
            for _ in 0..case.frames[0] {
                step(&mut *solver, case)?;
            }
            Some(&Frames::run(&mut *solver, case)?)
        }
    };
    // Without time stamps there are no stages.
    let timed = timed.filter(|timed| !timed.stages.is_empty());
    let device = timed.map(|timed| Statistics::new(timed.device.clone()));
    let stages = timed.unwrap_or(&frames).stages.clone();
    let [columns, rows] = case.size();
    let last = &frames.last;
    Ok(Record {
        group: case.group.into(),
        backend: engine.name().into(),
        label: case.label.clone(),
        columns,
        rows,
        precision: case.config.precision.to_string(),
        threads: case.config.threads.map(usize::from),
        iterations: case.iterations(),
        substeps: last.substeps,
        frames: case.frames,
        first_frame,
        frame: Statistics::new(frames.wall.clone()),
        device,
        in_a_row,
        bytes: case.bytes,
        memory_host: memory_host / particles,
        memory_device: memory_device.map(|bytes| bytes / particles),
        stages,
        quality: Quality {
            strain_mean: last.measures.strain_mean,
            strain_max: last.measures.strain_max,
            residual: frames.residual,
            contacts: last.contacts,
            difference,
        },
        verdict: if case.frames[1] == 0 { Verdict::Unchecked("no frames".into()) } else { verdict },
        published: case.published,
    })
}

/// Frames one by one.
struct Frames {
    wall: Vec<f64>,
    /// By the times of stages, without those that only report.
    device: Vec<f64>,
    /// Mean in a frame \[ms\].
    stages: Vec<(String, f64)>,
    residual: f64,
    last: StepReport,
}

impl Frames {
    fn run(solver: &mut dyn Solver, case: &Case) -> Result<Self, CaseError> {
        let (mut wall, mut device) = (Vec::new(), Vec::new());
        let (mut stages, mut residual, mut last) = (Vec::new(), 0.0_f64, StepReport::default());
        for _ in 0..case.frames[1] {
            let start = Instant::now();
            last = step(solver, case)?;
            wall.push(milliseconds(start));
            let work = last.stage_times.iter().filter(|time| time.stage != STAGE_MEASURE);
            device.push(work.map(|time| time.time.as_secs_f64() * 1e3).sum());
            stages_add(&mut stages, &last, case.frames[1]);
            residual = residual.max(last.solver.residual);
        }
        Ok(Self { wall, device, stages, residual, last })
    }
}

fn step(solver: &mut dyn Solver, case: &Case) -> Result<StepReport, CaseError> {
    solver.advance(case.frame)?;
    Ok(solver.synchronize()?)
}

/// Mean time of a frame, if they are started one after the other and waited for together \[ms\].
fn frames_in_a_row(solver: &mut dyn Solver, case: &Case, state: &State) -> Result<f64, CaseError> {
    solver.upload(state)?;
    // Waits until the state is there.
    solver.download(&mut State::default())?;
    let start = Instant::now();
    for _ in 0..case.frames[1] {
        solver.advance(case.frame)?;
    }
    solver.synchronize()?;
    Ok(milliseconds(start) / case.frames[1].max(1) as f64)
}

fn stages_add(stages: &mut Vec<(String, f64)>, report: &StepReport, frames: usize) {
    for time in &report.stage_times {
        let share = time.time.as_secs_f64() * 1e3 / frames as f64;
        match stages.iter_mut().find(|(name, _)| name == time.stage) {
            Some((_, sum)) => *sum += share,
            None => stages.push((time.stage.into(), share)),
        }
    }
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{arguments::BackendName, suite::group};

    #[test]
    fn a_small_patch_is_valid_and_has_all_its_figures() {
        let engine = Engine::open(BackendName::Cpu, None).unwrap();
        let case = Case::sphere(group::CONTACT, 16, true).unwrap().over([2, 3]);
        let record = measure(&engine, engine.backend(), &case).unwrap();
        assert_eq!((record.verdict.clone(), record.substeps), (Verdict::Valid, 17));
        // Not the memory: other tests of this process take and free some at the same time.
        assert!(record.frame.median > 0.0 && record.rate() > Some(0.0));
        assert!(!record.stages.is_empty() && record.quality.strain_max > 0.0);
    }
}
