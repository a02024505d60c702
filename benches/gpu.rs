//! The common workloads on the GPU: time of a frame, of its stages, and what that means in bytes.
//!
//! `cargo bench -p cloth-benches --bench gpu [-- explicit|implicit|field] [SIDE ...]`. Times are those of frames 10 to 70. A frame
//! is timed in two ways: with its report, as an application runs that looks at every frame (the median); and in a row
//! of frames with one wait at their end (the mean). `cargo xtask bench` has medians by the device's clock.

use std::{error::Error, sync::Arc, time::Instant};

use cloth::{
    Backend, Frame, ImplicitSettings, Integrator, LinearSettings, Model, Preconditioner,
    SolverConfig, StageTime, State, StepReport,
    scene::{BenchKind, CompileOptions, bench_scene},
    wgpu::{WgpuBackend, WgpuOptions},
};
use cloth_benches::{
    FRAMES_BEFORE, FRAMES_MEASURED, HANG_STEP, HangWorkload, ITERATION_BYTES, STATE_BYTES,
    Workload, copy_rate_wgpu, field_cost, median,
};

/// Iterations of each implicit step.
const ITERATIONS: u32 = 30;

fn main() -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let backend = WgpuBackend::new(std::env::var("CLOTH_ADAPTER").ok().as_deref())?;
    println!("{}, opened in {:.0} ms", backend.info().device, milliseconds(start));
    let timed = WgpuBackend::with_options(&WgpuOptions {
        adapter: std::env::var("CLOTH_ADAPTER").ok(),
        stage_times: true,
        ..WgpuOptions::default()
    })?;
    let copy = copy_rate_wgpu(&backend)?;
    println!("copies run at {copy:.0} GB/s, read and write counted");
    let words: Vec<String> = std::env::args().skip(1).collect();
    let sides: Vec<u32> = words.iter().filter_map(|word| word.parse().ok()).collect();
    let wants = |table: &str| {
        let tables = ["explicit", "implicit", "field"];
        let named = words.iter().any(|word| tables.contains(&word.as_str()));
        !named || words.iter().any(|word| word == table)
    };
    let sides_of = |all: &[u32]| match sides.as_slice() {
        [] if backend.is_processor() => vec![64],
        [] => all.to_vec(),
        given => given.to_vec(),
    };
    if wants("explicit") {
        explicit(&backend, &timed, &sides_of(&[160, 256, 512, 1024]), copy)?;
    }
    if wants("implicit") {
        implicit(&backend, &timed, &sides_of(&[60, 160, 1024]), copy)?;
    }
    if wants("field") {
        for side in sides_of(&[1024]) {
            let cost = field_cost(&backend, side)?;
            println!(
                "\nN {side:>5} field: built in {:.4} ms, as an expression {:.4} ms ({:+.1} %), difference {:.1e}",
                cost.built_in * 1e3,
                cost.expression * 1e3,
                cost.share() * 100.0,
                cost.deviation,
            );
        }
    }
    Ok(())
}

fn explicit(
    backend: &WgpuBackend,
    timed: &WgpuBackend,
    sides: &[u32],
    copy: f64,
) -> Result<(), Box<dyn Error>> {
    println!(
        "{:<8}{:<9}{:>6}{:>12}{:>12}{:>12}{:>12}{:>10}{:>8}{:>10}{:>9}{:>9}",
        "scene",
        "contact",
        "N",
        "first ms",
        "report ms",
        "in a row",
        "Msteps/s",
        "GB/s",
        "of copy",
        "contacts",
        "rebuilds",
        "strain"
    );
    for contact in [false, true] {
        for &side in sides {
            case(backend, Workload::new(BenchKind::Sphere, side, contact), copy)?;
        }
    }
    for contact in [false, true] {
        for &side in sides {
            let workload = Workload::new(BenchKind::Sphere, side, contact);
            let mut running = workload.start(timed)?;
            let title = format!("N {side:>5} contact {contact:<6}");
            stages(&title, workload.particles() as f64, copy, || Ok(running.step()?))?;
        }
    }
    Ok(())
}

/// Steps of a sixtieth of a second on the hanging patch with 24 neighbours.
fn implicit(
    backend: &WgpuBackend,
    timed: &WgpuBackend,
    sides: &[u32],
    copy: f64,
) -> Result<(), Box<dyn Error>> {
    let settings = ImplicitSettings {
        linear: LinearSettings {
            preconditioner: Preconditioner::Diagonal,
            tolerance: 0.0,
            iterations_max: ITERATIONS,
            ..LinearSettings::default()
        },
        ..ImplicitSettings::default()
    };
    println!(
        "\nimplicit, {ITERATIONS} iterations a step of {HANG_STEP:.4} s\n{:>6}{:>12}{:>12}{:>12}{:>10}{:>8}{:>12}",
        "N", "first ms", "report ms", "in a row", "GB/s", "of copy", "residual"
    );
    for &side in sides {
        let workload = HangWorkload::new(side);
        let config = workload.config(Integrator::Implicit(settings));
        let (times, last) =
            measured(backend, workload.model()?, &config, Frame { duration: HANG_STEP })?;
        let bytes = ITERATION_BYTES * f64::from(ITERATIONS) * workload.particles() as f64;
        let rate = bytes / times.in_a_row / 1e6;
        println!(
            "{side:>6}{:>12.1}{:>12.4}{:>12.4}{rate:>10.0}{:>8.2}{:>12.2e}",
            times.first,
            times.with_report,
            times.in_a_row,
            rate / copy,
            last.solver.residual
        );
    }
    for &side in sides {
        let workload = HangWorkload::new(side);
        let mut running = workload.start(timed, Integrator::Implicit(settings), FRAMES_BEFORE)?;
        let title = format!("N {side:>5} implicit");
        stages(&title, workload.particles() as f64, copy, || Ok(running.step()?))?;
    }
    Ok(())
}

fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Times of a frame \[ms\].
struct Times {
    /// The first one, with all that comes before it.
    first: f64,
    /// With a report after each.
    with_report: f64,
    /// In a row of frames with one wait at their end.
    in_a_row: f64,
    /// Candidate lists built in a frame.
    rebuilds: f64,
}

fn measured(
    backend: &WgpuBackend,
    model: Arc<Model>,
    config: &SolverConfig,
    frame: Frame,
) -> Result<(Times, StepReport), Box<dyn Error>> {
    let start = Instant::now();
    let mut solver = backend.create_solver(model, config)?;
    solver.advance(frame)?;
    solver.synchronize()?;
    let first = milliseconds(start);
    for _ in 1..FRAMES_BEFORE {
        solver.advance(frame)?;
        solver.synchronize()?;
    }
    let mut state = State::default();
    solver.download(&mut state)?;
    let mut times = Vec::new();
    let mut last = StepReport::default();
    let mut rebuilds = 0;
    for _ in 0..FRAMES_MEASURED {
        let start = Instant::now();
        solver.advance(frame)?;
        last = solver.synchronize()?;
        times.push(milliseconds(start));
        rebuilds += last.contact_rebuilds;
    }
    let with_report = median(&mut times);
    let mut times = Vec::new();
    for _ in 0..3 {
        solver.upload(&state)?;
        solver.download(&mut state)?;
        let start = Instant::now();
        for _ in 0..FRAMES_MEASURED {
            solver.advance(frame)?;
        }
        solver.synchronize()?;
        times.push(milliseconds(start) / FRAMES_MEASURED as f64);
    }
    let in_a_row = median(&mut times);
    let rebuilds = f64::from(rebuilds) / FRAMES_MEASURED as f64;
    Ok((Times { first, with_report, in_a_row, rebuilds }, last))
}

fn case(backend: &WgpuBackend, workload: Workload, copy: f64) -> Result<(), Box<dyn Error>> {
    let compiled = bench_scene(workload.kind, workload.side, workload.contact)
        .compile(&CompileOptions::default())?;
    let frame = Frame::per_second(compiled.frames_per_second);
    let (times, last) = measured(backend, compiled.model, &compiled.config, frame)?;
    let Times { first, with_report, in_a_row, rebuilds } = times;
    let steps = workload.particles() as f64 * f64::from(last.substeps);
    let rate = steps * STATE_BYTES / in_a_row / 1e6;
    println!(
        "{:<8}{:<9}{:>6}{first:>12.1}{with_report:>12.4}{in_a_row:>12.4}{:>12.0}{rate:>10.0}{:>8.2}{:>10}{rebuilds:>9.2}{:>9.4}",
        workload.scene(),
        workload.contact,
        workload.side,
        steps / in_a_row / 1e3,
        rate / copy,
        last.contacts,
        last.measures.strain_mean,
    );
    Ok(())
}

/// Bytes that a stage must read and write in a frame for each particle, if every number comes from memory once.
fn stage_bytes(stage: &str, report: &StepReport) -> Option<f64> {
    // Position and velocity; where a particle is in no contact nothing else need be known of it.
    let state_read = STATE_BYTES / 2.0;
    match stage {
        "explicit_substep" => Some(STATE_BYTES * f64::from(report.substeps)),
        // Where a list is built.
        "contact_candidates" => Some(state_read * f64::from(report.contact_rebuilds)),
        "conjugate_gradient" => Some(ITERATION_BYTES * f64::from(ITERATIONS)),
        "measure" => Some(state_read),
        _ => None,
    }
}

/// Mean times of single stages by the clock of the device, and how fast they move what they must \[GB/s\].
fn stages(
    title: &str,
    particles: f64,
    copy: f64,
    mut step: impl FnMut() -> Result<StepReport, Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    let mut sums: Vec<(StageTime, Option<f64>)> = Vec::new();
    for _ in 0..FRAMES_MEASURED {
        let report = step()?;
        for &time in &report.stage_times {
            let bytes = stage_bytes(time.stage, &report);
            match sums.iter_mut().find(|(sum, _)| sum.stage == time.stage) {
                Some((sum, all)) => {
                    sum.time += time.time;
                    *all = all.zip(bytes).map(|(all, bytes)| all + bytes);
                }
                None => sums.push((time, bytes)),
            }
        }
    }
    for (sum, bytes) in sums {
        let seconds = sum.time.as_secs_f64();
        let time = seconds * 1e6 / FRAMES_MEASURED as f64;
        print!("stage {:<22} {title}{time:>10.1} us a frame", sum.stage);
        match bytes.map(|bytes| bytes * particles / seconds / 1e9) {
            Some(rate) => println!("{rate:>10.1} GB/s{:>8.3} of copy", rate / copy),
            None => println!(),
        }
    }
    Ok(())
}
