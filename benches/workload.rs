//! The common workload beside a plain reference program, in one run, and memory per particle.
//!
//! `cargo bench -p cloth-benches --bench workload` compiles `reference/explicit.cpp` with `c++ -O3 -march=native`, lets it
//! run before and after ours, and prints the ratios. The variable `CLOTH_REFERENCE` names another source, which
//! prints a CSV table with the columns scene, self, N, ms_per_frame; with `none` ours runs alone, and the table says so.

use std::{collections::HashMap, path::Path, process::ExitCode, time::Instant};

use cloth::{
    Backend, State,
    scene::{BenchKind, CompileOptions, bench_scene},
};
use cloth_benches::{FRAMES_MEASURED, Workload, median, reference_chosen, reference_run};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Scene, self-contact, particles along a side.
type Case = (String, bool, u32);

/// Median time of a frame of each case \[ms\].
type Times = HashMap<Case, f64>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let program = reference_chosen("explicit", Path::new(env!("CARGO_TARGET_TMPDIR")))?;
    let before = program.as_deref().map(times).transpose()?;
    let backend = cloth::backend_create("cpu", None)?;
    let mut ours = Vec::new();
    for kind in [BenchKind::Hang, BenchKind::Sphere] {
        for contact in [false, true] {
            for side in [160, 256] {
                ours.push(measure(&*backend, Workload::new(kind, side, contact))?);
            }
        }
    }
    let after = program.as_deref().map(times).transpose()?;
    println!("\nCPU, f32, {}, median of frames 10 to 70", backend.info().device);
    println!(
        "{:<8}{:<10}{:>5}{:>10}{:>12}{:>10}{:>10}{:>22}{:>8}",
        "scene",
        "contact",
        "N",
        "ms/frame",
        "Msteps/s",
        "strain",
        "contacts",
        "reference ms",
        "ratio"
    );
    for row in &ours {
        print!(
            "{:<8}{:<10}{:>5}{:>10.3}{:>12.1}{:>10.4}{:>10}",
            row.case.0,
            row.case.1,
            row.case.2,
            row.milliseconds,
            row.rate,
            row.strain,
            row.contacts
        );
        let pair = before.as_ref().zip(after.as_ref());
        match pair.and_then(|(a, b)| Some((a.get(&row.case)?, b.get(&row.case)?))) {
            Some((a, b)) => {
                println!("{a:>11.2}{b:>11.2}{:>8.1}", 0.5 * (a + b) / row.milliseconds);
            }
            None => println!("{:>22}{:>8}", "not run", "-"),
        }
    }
    if program.is_none() {
        println!("no reference, as CLOTH_REFERENCE says");
    }
    memory(&*backend)
}

struct Row {
    case: Case,
    milliseconds: f64,
    /// Million particle-steps per second.
    rate: f64,
    strain: f64,
    contacts: u64,
}

fn measure(backend: &dyn Backend, workload: Workload) -> cloth::Result<Row> {
    let mut running = workload.start(backend)?;
    let mut times = Vec::with_capacity(FRAMES_MEASURED);
    let mut last = None;
    for _ in 0..FRAMES_MEASURED {
        let start = Instant::now();
        let report = running.step()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        last = Some(report);
    }
    let milliseconds = median(&mut times);
    let report = last.unwrap_or_default();
    let steps = workload.particles() as f64 * f64::from(report.substeps);
    Ok(Row {
        case: (workload.scene().to_owned(), workload.contact, workload.side),
        milliseconds,
        rate: steps / milliseconds / 1e3,
        strain: report.measures.strain_mean,
        contacts: report.contacts,
    })
}

/// Bytes per particle of a large patch, by the allocator's count.
fn memory(backend: &dyn Backend) -> Result<(), Box<dyn std::error::Error>> {
    const SIDE: u32 = 512;
    println!("\nbytes per particle of a {SIDE} x {SIDE} patch, f32");
    for contact in [false, true] {
        let particles = f64::from(SIDE) * f64::from(SIDE);
        let base = MEMORY.current_usage();
        let per_particle = |bytes: usize| bytes.saturating_sub(base) as f64 / particles;
        MEMORY.reset_peak_usage();
        let compiled =
            bench_scene(BenchKind::Sphere, SIDE, contact).compile(&CompileOptions::default())?;
        let model = per_particle(MEMORY.current_usage());
        let model_peak = per_particle(MEMORY.peak_usage());
        MEMORY.reset_peak_usage();
        let mut solver = backend.create_solver(compiled.model.clone(), &compiled.config)?;
        let solver_peak = per_particle(MEMORY.peak_usage());
        MEMORY.reset_peak_usage();
        let mut state = State::default();
        for _ in 0..12 {
            solver.advance(cloth::Frame::per_second(60.0))?;
            solver.synchronize()?;
            solver.download(&mut state)?;
        }
        println!(
            "contact {contact:<6} model {model:.0}, all while it runs {:.0} (peak {:.0}), peak while \
             the model is built {model_peak:.0}, the solver {solver_peak:.0}",
            per_particle(MEMORY.current_usage()),
            per_particle(MEMORY.peak_usage()),
        );
    }
    Ok(())
}

/// Runs the reference with ten seconds for each case, enough for all measured frames.
fn times(program: &Path) -> Result<Times, Box<dyn std::error::Error>> {
    let mut times = Times::new();
    for row in reference_run(program, 10, &["scene", "self", "N", "ms_per_frame"])? {
        let with_contact = match row["self"].as_str() {
            "none" => false,
            "grid" => true,
            _ => continue,
        };
        times.insert(
            (row["scene"].clone(), with_contact, row["N"].parse()?),
            row["ms_per_frame"].parse()?,
        );
    }
    Ok(times)
}
