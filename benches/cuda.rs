//! The CUDA backend on the common workload, timed by events on the device: medians of frames 10 to 70, and their mean and longest.
//!
//! `cargo bench --bench cuda -- [--quick] [--sides 160,1024] [--only free|contact|implicit|field] [--ladder] [--reference PROGRAM]`. `--ladder`
//! prints the table of the historical ladder alone. A reference program is run as `PROGRAM 160,1024` and
//! prints its own rows.

use std::{process::Command, time::Instant};

use cloth::{
    Backend, ImplicitSettings, Integrator, LinearMethod, Preconditioner, Result, StepReport,
    cuda::{CudaBackend, CudaOptions},
    scene::BenchKind,
};
use cloth_benches::{
    FRAMES_MEASURED, HangWorkload, RunningWorkload, STATE_BYTES, Workload, field_cost,
    ladder::{LADDER_SIDES, Ladder, ladder_heading, ladder_line, ladder_row},
    median,
};

/// Bytes that a device of this kind copies in a second, read and written: the floor is made of it.
const BANDWIDTH: f64 = 4.28e12;

/// Iterations of the linear solvers.
const ITERATIONS: u32 = 30;
/// Implicit steps that are measured, and those before.
const STEPS: [usize; 2] = [20, 5];

/// Microseconds of all stages but the measurement.
fn device_time(report: &StepReport) -> f64 {
    let stages = report.stage_times.iter().filter(|stage| stage.stage != "measure");
    stages.map(|stage| stage.time.as_secs_f64()).sum::<f64>() * 1e6
}

fn implicit(backend: &dyn Backend, label: &str, side: u32, method: LinearMethod) -> Result<()> {
    let mut settings = ImplicitSettings::default();
    settings.linear.method = method;
    settings.linear.preconditioner = Preconditioner::Diagonal;
    settings.linear.tolerance = 0.0;
    settings.linear.iterations_max = ITERATIONS;
    let workload = HangWorkload::new(side);
    let mut running: RunningWorkload =
        workload.start(backend, Integrator::Implicit(settings), STEPS[1])?;
    let mut device = Vec::new();
    for _ in 0..STEPS[0] {
        device.push(device_time(&running.step()?));
    }
    // Bytes of a particle in each iteration. Conjugate gradient: twelve roots, origin, diagonal and preconditioner, five vectors read
    // and four written, y and a product read and written in part. Jacobi: the right-hand side, two vectors read and two written.
    let bytes = match method {
        LinearMethod::Jacobi => 48.0 + 3.0 * 16.0 + 5.0 * 16.0 + 16.0,
        _ => 48.0 + 3.0 * 16.0 + 9.0 * 16.0 + 16.0,
    };
    let particles = workload.particles() as f64;
    let floor = f64::from(ITERATIONS) * particles * bytes / BANDWIDTH * 1e6;
    let time = median(&mut device);
    println!("{label:<12} {side:>5} {method:<7} {time:>9.1} us/step   floor {floor:>7.1}");
    Ok(())
}

fn explicit(backend: &dyn Backend, label: &str, side: u32, contact: bool) -> Result<()> {
    let workload = Workload::new(BenchKind::Sphere, side, contact);
    let started = Instant::now();
    let mut running = workload.start(backend)?;
    let (mut device, mut wall, mut rebuilds) = (Vec::new(), Vec::new(), 0);
    let mut last = None;
    for _ in 0..FRAMES_MEASURED {
        let report = running.step()?;
        device.push(device_time(&report));
        wall.push(report.wall_time.as_secs_f64() * 1e6);
        rebuilds += report.contact_rebuilds;
        last = Some(report);
    }
    let Some(report) = last else { return Ok(()) };
    let particles = f64::from(side) * f64::from(side);
    let floor = 17.0 * particles * STATE_BYTES / BANDWIDTH * 1e6;
    let mean = device.iter().sum::<f64>() / device.len() as f64;
    let longest = device.iter().copied().fold(0.0, f64::max);
    println!(
        "{label:<12} {side:>5} {:<7} {:>9.1} us/frame  mean {:>7.1}  longest {:>7.1}  wall {:>9.1}  floor {floor:>7.1}  strain mean {:.4}  rebuilds/frame {:.1}  contacts {}  ({:.1} s)",
        if contact { "contact" } else { "free" },
        median(&mut device),
        mean,
        longest,
        median(&mut wall),
        report.measures.strain_mean,
        f64::from(rebuilds) / FRAMES_MEASURED as f64,
        report.contacts,
        started.elapsed().as_secs_f64(),
    );
    Ok(())
}

/// The table of the ladder; without a GPU only its base.
fn ladder(sides: &[u32]) -> Result<()> {
    let ladder = Ladder::new(CudaOptions::default());
    if let Err(error) = &ladder {
        println!("cuda: not run here: {error}");
    }
    println!("{}", ladder_heading());
    for &side in sides {
        println!("{}", ladder_line(&ladder_row(ladder.as_ref().ok(), side)?));
    }
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |name: &str| arguments.iter().any(|argument| argument == name);
    if has("--list") || has("--test") {
        return Ok(());
    }
    let value = |name: &str| {
        let at = arguments.iter().position(|argument| argument == name)?;
        arguments.get(at + 1).map(String::as_str)
    };
    let given = value("--sides").map(|text| text.split(',').filter_map(|side| side.parse().ok()));
    let given: Option<Vec<u32>> = given.map(Iterator::collect);
    if has("--ladder") {
        return ladder(given.as_deref().unwrap_or(&LADDER_SIDES));
    }
    let sides: Vec<u32> = match given {
        Some(sides) => sides,
        None if has("--quick") => vec![160, 512],
        None => vec![160, 512, 1024, 2048],
    };
    let is_wanted = |what: &str| value("--only").is_none_or(|only| only == what);
    for (label, fast, patches) in [
        ("reproducible", false, true),
        ("fast", true, true),
        ("rep. no grid", false, false),
        ("fast no grid", true, false),
    ] {
        let options = CudaOptions { fast, patches, ..CudaOptions::default() };
        let backend = match CudaBackend::new(options) {
            Ok(backend) => backend,
            Err(error) => {
                println!("cuda: not run here: {error}");
                return Ok(());
            }
        };
        for contact in [false, true] {
            for &side in &sides {
                let kind = if contact { "contact" } else { "free" };
                if !is_wanted(kind) || !patches && (contact && side != 160 || side == 2048) {
                    continue;
                }
                explicit(&backend, label, side, contact)?;
            }
        }
        if patches && is_wanted("field") {
            let side = if has("--quick") { 512 } else { 1024 };
            let cost = field_cost(&backend, side)?;
            println!(
                "{label:<12} {side:>5} field   built in {:>9.1} us/frame  as an expression {:>9.1}  {:+.1} %  difference {:.1e}",
                cost.built_in * 1e6,
                cost.expression * 1e6,
                cost.share() * 100.0,
                cost.deviation,
            );
        }
        for method in [LinearMethod::ConjugateGradient, LinearMethod::Jacobi] {
            for side in [60, 160, 512, 1024] {
                if patches && is_wanted("implicit") && (side < 1024 || !has("--quick")) {
                    implicit(&backend, label, side, method)?;
                }
            }
        }
    }
    if let Some(program) = value("--reference") {
        match Command::new(program).arg("160,1024").status() {
            Ok(status) if status.success() => {}
            Ok(status) => println!("{program}: {status}"),
            Err(error) => println!("{program}: {error}"),
        }
    }
    Ok(())
}
