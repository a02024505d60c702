//! One linear system, with the preconditioner that `Auto` stands for (NUMERICS §5).

use crate::{
    Kernels, LinearMethod, LinearOutcome, LinearSettings, LinearStart, Preconditioner, Result,
    SolverReport,
};

/// `Block` may take this many iterations before `Schwarz`, one of which takes three times as long, goes on.
const BLOCK_ITERATIONS: u32 = 250;

/// Solves the system that is in place, and books it in `report`.
///
/// `Auto` is `Block` until that has taken too many iterations once in a frame, and from there on `Schwarz`: how many it takes follows from stiffness, step and
/// the shapes of triangles more than from the number of particles.
///
/// # Errors
/// Those of the stages.
pub(in super::super) fn system_solve<K: Kernels + ?Sized>(
    kernels: &mut K,
    settings: &LinearSettings,
    start: LinearStart,
    report: &mut SolverReport,
) -> Result<LinearOutcome> {
    let is_iterative = settings.method == LinearMethod::ConjugateGradient;
    let is_open = is_iterative && settings.preconditioner == Preconditioner::Auto;
    let is_trial = is_open && !report.needs_schwarz && settings.iterations_max > BLOCK_ITERATIONS;
    let preconditioner = settings.preconditioner.after(report.needs_schwarz);
    let mut linear = LinearSettings { preconditioner, ..*settings };
    if is_trial {
        linear.iterations_max = BLOCK_ITERATIONS;
    }
    let solver = settings.method.solver::<K>();
    solver.prepare(kernels, &linear)?;
    let mut outcome = solver.solve(kernels, &linear, start)?;
    let has_tried = is_trial && outcome.iterations == BLOCK_ITERATIONS;
    if has_tried && !(outcome.converged || outcome.breakdown) {
        report.needs_schwarz = true;
        let iterations_max = settings.iterations_max - outcome.iterations;
        let preconditioner = Preconditioner::Schwarz;
        linear = LinearSettings { preconditioner, iterations_max, ..*settings };
        solver.prepare(kernels, &linear)?;
        let rest = solver.solve(kernels, &linear, LinearStart::Solution)?;
        outcome = LinearOutcome {
            iterations: outcome.iterations + rest.iterations,
            restarted: outcome.restarted || rest.restarted,
            ..rest
        };
    }
    report.preconditioner = is_iterative.then_some(linear.preconditioner);
    report.add(&outcome);
    Ok(outcome)
}
