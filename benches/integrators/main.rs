//! The three integrators beside each other, and the implicit one beside a plain reference program.
//!
//! `cargo bench -p cloth-benches --bench integrators` compiles `reference/implicit.cpp` with `c++ -O3 -march=native` and
//! lets it run before and after ours. The variable `CLOTH_REFERENCE` names another source, which prints a CSV
//! table with the columns scene, N, ms_per_frame, frames, mean_strain, rel_residual; with `none` ours runs alone. Names of tables after `--` print these alone:
//! `paired`, `solvers`, `semi-implicit`, `guide`, `memory`.

mod guide;
mod memory;
mod paired;
mod semi_implicit;
mod solvers;

use std::{env, error::Error, process::ExitCode};

use cloth::{Backend, StepReport};
use cloth_benches::{RunningWorkload, median};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Prints one table.
type Table = fn(&dyn Backend) -> Result<(), Box<dyn Error>>;

const TABLES: [(&str, Table); 5] = [
    ("paired", paired::print),
    ("solvers", solvers::print),
    ("semi-implicit", semi_implicit::print),
    ("guide", guide::print),
    ("memory", memory::print),
];

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    // Cargo adds options of its own.
    let chosen: Vec<String> = env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    if let Some(unknown) = chosen.iter().find(|word| TABLES.iter().all(|(name, _)| name != word)) {
        return Err(format!("no table `{unknown}`: use {}", TABLES.map(|t| t.0).join(", ")).into());
    }
    let backend = cloth::backend_create("cpu", None)?;
    println!("CPU, f32, {}", backend.info().device);
    for (name, print) in TABLES {
        if chosen.is_empty() || chosen.iter().any(|word| word == name) {
            print(&*backend)?;
        }
    }
    Ok(())
}

/// Median time of the measured steps \[ms\], and the report of the last one.
struct Timing {
    milliseconds: f64,
    /// Linear iterations of a step, on average.
    iterations: f64,
    /// Largest relative residual of a linear solve.
    residual: f64,
    report: StepReport,
}

/// Runs `count` steps or frames.
fn timing(running: &mut RunningWorkload, count: usize) -> cloth::Result<Timing> {
    let mut times = Vec::with_capacity(count);
    let mut result =
        Timing { milliseconds: 0.0, iterations: 0.0, residual: 0.0, report: StepReport::default() };
    for _ in 0..count {
        let start = std::time::Instant::now();
        result.report = running.step()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        result.iterations += result.report.solver.iterations as f64 / count as f64;
        result.residual = result.residual.max(result.report.solver.residual);
    }
    result.milliseconds = median(&mut times);
    Ok(result)
}
