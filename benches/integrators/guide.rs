//! The table of the guide to the integrators: one scene, one frame, each integrator with the step that
//! suits it.

use std::error::Error;

use cloth::{
    Backend, Frame,
    scene::{BenchKind, CompileOptions, SceneSolver, bench_scene},
};
use cloth_benches::RunningWorkload;

use crate::timing;

/// Frames of a second.
const FRAMES: usize = 60;

pub(crate) fn print(backend: &dyn Backend) -> Result<(), Box<dyn Error>> {
    println!(
        "\nsphere, 12 neighbours, without self-contact: one frame of 1/60 s, median of a second; \
         strain and energy after it"
    );
    println!(
        "{:>5}  {:<15}{:>9}{:>10}{:>12}{:>12}{:>12}{:>12}{:>12}",
        "N",
        "integrator",
        "substeps",
        "ms/frame",
        "iterations",
        "mean",
        "max",
        "energy J",
        "kinetic J"
    );
    for side in [33, 160] {
        for &solver in SceneSolver::ALL {
            let mut scene = bench_scene(BenchKind::Sphere, side, false);
            scene.simulation.solver = Some(solver);
            let compiled = scene.compile(&CompileOptions::default())?;
            let solver_made = backend.create_solver(compiled.model, &compiled.config)?;
            let frame = Frame::per_second(compiled.frames_per_second);
            let mut running = RunningWorkload::new(solver_made, frame, 0)?;
            print!("{side:>5}  {:<15}", solver.name());
            match timing(&mut running, FRAMES) {
                Ok(timing) => {
                    let measures = &timing.report.measures;
                    println!(
                        "{:>9}{:>10.3}{:>12.1}{:>12.4}{:>12.4}{:>12.4e}{:>12.2e}",
                        timing.report.substeps,
                        timing.milliseconds,
                        timing.iterations,
                        measures.strain_mean,
                        measures.strain_max,
                        measures.energy(),
                        measures.energy_kinetic,
                    );
                }
                Err(cloth::Error::Unsupported { .. }) => println!("{:>15}", "not supported"),
                Err(error) => return Err(error.into()),
            }
        }
    }
    Ok(())
}
