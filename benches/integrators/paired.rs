//! Thirty iterations of conjugate gradients with a diagonal preconditioner, one step for each frame, beside
//! the reference program that does the same.

use std::{error::Error, path::Path};

use cloth::{Backend, ImplicitSettings, Integrator, LinearSettings, Preconditioner};
use cloth_benches::{HangWorkload, ReferenceRow, reference_chosen, reference_run};

use crate::timing;

/// Steps before measurements start, and measured, as in the reference.
const STEPS: [usize; 2] = [5, 60];

/// Seconds that the reference may take for each size: enough for all its steps.
const SECONDS: u32 = 60;

const COLUMNS: [&str; 5] = ["N", "ms_per_frame", "frames", "mean_strain", "rel_residual"];

pub(crate) fn print(backend: &dyn Backend) -> Result<(), Box<dyn Error>> {
    let program = reference_chosen("implicit", Path::new(env!("CARGO_TARGET_TMPDIR")))?;
    let run = |program: &Path| reference_run(program, SECONDS, &COLUMNS);
    let before = program.as_deref().map(run).transpose()?;
    let linear = LinearSettings {
        preconditioner: Preconditioner::Diagonal,
        tolerance: 0.0,
        iterations_max: 30,
        ..LinearSettings::default()
    };
    let integrator =
        Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() });
    let mut lines = Vec::new();
    for side in [60, 128, 160, 256] {
        let workload = HangWorkload::new(side);
        let mut running = workload.start(backend, integrator.clone(), STEPS[0])?;
        let timing = timing(&mut running, STEPS[1])?;
        let strain = workload.strain_mean(&running.state()?);
        let residual = timing.report.solver.residual;
        lines.push((side, timing.milliseconds, strain, residual));
    }
    let after = program.as_deref().map(run).transpose()?;
    println!("\nhang, 24 neighbours, h = 1/60 s, 30 iterations, diagonal: median of 60 steps");
    println!(
        "{:>5}{:>10}{:>10}{:>10}{:>24}{:>8}{:>10}{:>10}",
        "N", "ms/step", "strain", "residual", "reference ms", "ratio", "strain", "residual"
    );
    for (side, milliseconds, strain, residual) in lines {
        print!("{side:>5}{milliseconds:>10.3}{strain:>10.4}{residual:>10.2e}");
        match before.as_deref().zip(after.as_deref()) {
            Some((before, after)) => reference_print(side, milliseconds, [before, after])?,
            None => println!("{:>24}{:>8}", "not run", "-"),
        }
    }
    if program.is_none() {
        println!("no reference, as CLOTH_REFERENCE says");
    }
    Ok(())
}

fn reference_print(
    side: u32,
    milliseconds: f64,
    runs: [&[ReferenceRow]; 2],
) -> Result<(), Box<dyn Error>> {
    let rows = runs.map(|rows| rows.iter().find(|row| row["N"] == side.to_string()));
    let [Some(before), Some(after)] = rows else {
        println!("{:>24}{:>8}", "no such size", "-");
        return Ok(());
    };
    let number = |row: &ReferenceRow, column: &str| row[column].parse::<f64>();
    let [a, b] = [number(before, "ms_per_frame")?, number(after, "ms_per_frame")?];
    let ratio = 0.5 * (a + b) / milliseconds;
    let [strain, residual] = [number(after, "mean_strain")?, number(after, "rel_residual")?];
    let steps: usize = after["frames"].parse()?;
    let note = if steps == STEPS[1] { String::new() } else { format!(" (after {steps} steps)") };
    println!("{a:>12.2}{b:>12.2}{ratio:>8.1}{strain:>10.4}{residual:>10.2e}{note}");
    Ok(())
}
