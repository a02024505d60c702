//! Time and iterations of each linear solver to a relative residual of 0.001.

use cloth::{
    Backend, Error, Frame, ImplicitSettings, Integrator, LinearMethod, LinearSettings, MatrixForm,
    Preconditioner, State,
};
use cloth_benches::{HANG_STEP, HangWorkload, RunningWorkload};

use crate::timing;

/// Steps before measurements start: all solvers then go on from the same state.
const STEPS_BEFORE: usize = 20;

/// Steps that are measured.
const STEPS: usize = 10;

/// Cap on iterations of Jacobi, which needs many more than conjugate gradients.
const JACOBI_MAX: u32 = 2000;

/// Particles along a side up to which the direct solver takes part.
const DIRECT_MAX: u32 = 60;

pub(crate) fn print(backend: &dyn Backend) -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "\nhang, 24 neighbours, h = 1/60 s, to a relative residual of 0.001: median of {STEPS} steps"
    );
    println!(
        "{:>5}  {:<8}{:<22}{:<14}{:>10}{:>12}{:>12}",
        "N", "method", "preconditioner", "matrix", "ms/step", "iterations", "residual"
    );
    for side in [60, 160, 256] {
        let workload = HangWorkload::new(side);
        let start = Integrator::Implicit(ImplicitSettings::default());
        let state = workload.start(backend, start, STEPS_BEFORE)?.state()?;
        for settings in methods(side) {
            row(backend, workload, &state, settings)?;
        }
    }
    Ok(())
}

fn methods(side: u32) -> Vec<LinearSettings> {
    let mut methods = Vec::new();
    for &preconditioner in Preconditioner::ALL {
        for &matrix in MatrixForm::ALL {
            methods.push(LinearSettings {
                preconditioner,
                matrix,
                iterations_max: 1000,
                ..LinearSettings::default()
            });
        }
    }
    methods.push(LinearSettings {
        method: LinearMethod::Jacobi,
        iterations_max: JACOBI_MAX,
        ..LinearSettings::default()
    });
    if side <= DIRECT_MAX {
        methods.push(LinearSettings { method: LinearMethod::Direct, ..LinearSettings::default() });
    }
    methods
}

fn row(
    backend: &dyn Backend,
    workload: HangWorkload,
    state: &State,
    linear: LinearSettings,
) -> cloth::Result<()> {
    let (preconditioner, matrix) = match linear.method {
        LinearMethod::ConjugateGradient => (linear.preconditioner.name(), linear.matrix.name()),
        LinearMethod::Jacobi => ("-", linear.matrix.name()),
        _ => ("-", "-"),
    };
    let side = workload.side;
    print!("{side:>5}  {:<8}{preconditioner:<22}{matrix:<14}", linear.method.name());
    let integrator =
        Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() });
    let mut solver = backend.create_solver(workload.model()?, &workload.config(integrator))?;
    solver.upload(state)?;
    let mut running = RunningWorkload::new(solver, Frame { duration: HANG_STEP }, 0)?;
    match timing(&mut running, STEPS) {
        Ok(timing) => println!(
            "{:>10.2}{:>12.1}{:>12.2e}",
            timing.milliseconds, timing.iterations, timing.residual
        ),
        Err(Error::Unsupported { .. }) => println!("{:>10}", "not supported"),
        Err(error) => return Err(error),
    }
    Ok(())
}
