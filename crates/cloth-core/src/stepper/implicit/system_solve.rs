//! One linear system, with the preconditioner that `Auto` stands for (NUMERICS §5).

use crate::{
    AutoPreconditioner, Kernels, LinearMethod, LinearOutcome, LinearSettings, LinearStart,
    Preconditioner, Result, SolverReport,
};

/// Solves the system that is in place, and books it in `report`.
///
/// Where `Auto` leaves `Block` only so many iterations, `Schwarz` goes on from there.
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
    let mut linear = *settings;
    let mut trial = None;
    if is_iterative && settings.preconditioner == Preconditioner::Auto {
        linear.preconditioner = report.auto.resolve(Preconditioner::Auto);
        if let AutoPreconditioner::Block(most) = report.auto
            && most < settings.iterations_max
        {
            linear.iterations_max = most;
            trial = Some(most);
        }
    }
    let solver = settings.method.solver::<K>();
    solver.prepare(kernels, &linear)?;
    let mut outcome = solver.solve(kernels, &linear, start)?;
    let has_ended = outcome.converged || outcome.breakdown;
    if !has_ended && trial == Some(outcome.iterations) {
        let iterations_max = settings.iterations_max - outcome.iterations;
        let preconditioner = Preconditioner::Schwarz;
        linear = LinearSettings { preconditioner, iterations_max, ..*settings };
        solver.prepare(kernels, &linear)?;
        let rest = solver.solve(kernels, &linear, LinearStart::Solution)?;
        report.auto = report.auto.after(outcome.residual, &rest);
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
