//! The composite stages, and whole substeps.

use cloth_core::{
    ImplicitSettings, Kernels, LinearOutcome, LinearSettings, LinearStart, LinearVector,
    Preconditioner, Result, SolverReport, State, stepper,
};

use super::prepared::Prepared;
use crate::{
    Verdict,
    backends::{Candidate, reference},
    models::Description,
    verdict::ensure,
};

type Solve = fn(&mut dyn Kernels, &LinearSettings, LinearStart) -> Result<LinearOutcome>;

/// Two solvers give the same bits and say the same of them, from both starts.
fn compare_solvers(
    candidate: &Candidate,
    description: &Description,
    settings: &LinearSettings,
    solvers: [Solve; 2],
) -> Verdict {
    for start in [LinearStart::Constraints, LinearStart::Solution] {
        let mut results = Vec::new();
        for solve in solvers {
            let mut prepared = Prepared::at_start(candidate, description)?;
            prepared.constrain()?;
            prepared.kernels.preconditioner_build(settings.preconditioner)?;
            prepared.fill(candidate, LinearVector::Solution)?;
            let outcome = solve(&mut *prepared.kernels, settings, start)?;
            results.push((outcome, prepared.read(LinearVector::Solution)?));
        }
        let [(fused, fused_y), (staged, staged_y)] = [&results[0], &results[1]];
        ensure(fused == staged, || {
            format!("{}: {start:?}: fused {fused:?}, staged {staged:?}", candidate.label)
        })?;
        let difference = fused_y
            .iter()
            .zip(staged_y)
            .position(|(a, b)| a.map(f64::to_bits) != b.map(f64::to_bits));
        ensure(difference.is_none(), || {
            format!("{}: {start:?}: differs at particle {difference:?}", candidate.label)
        })?;
        ensure(!fused.breakdown, || format!("{}: {fused:?}", candidate.label))?;
    }
    Ok(())
}

/// `conjugate_gradient` of a backend against the same stages run one by one: the same bits.
///
/// # Errors
/// What is wrong.
pub fn conjugate_gradient(
    candidate: &Candidate,
    description: &Description,
    preconditioner: Preconditioner,
) -> Verdict {
    let settings = LinearSettings {
        preconditioner,
        tolerance: 1e-4,
        iterations_max: 25,
        ..LinearSettings::default()
    };
    let staged = |kernels: &mut dyn Kernels, settings: &LinearSettings, start: LinearStart| {
        stepper::linear::conjugate_gradient(kernels, settings, start)
    };
    let fused = |kernels: &mut dyn Kernels, settings: &LinearSettings, start: LinearStart| {
        kernels.conjugate_gradient(settings, start)
    };
    compare_solvers(candidate, description, &settings, [fused, staged])
}

/// `jacobi` of a backend against the same stages run one by one: the same bits.
///
/// # Errors
/// What is wrong.
pub fn jacobi(candidate: &Candidate, description: &Description) -> Verdict {
    let settings =
        LinearSettings { tolerance: 1e-3, iterations_max: 15, ..LinearSettings::default() };
    let staged = |kernels: &mut dyn Kernels, settings: &LinearSettings, start: LinearStart| {
        stepper::linear::jacobi(kernels, settings, start)
    };
    let fused = |kernels: &mut dyn Kernels, settings: &LinearSettings, start: LinearStart| {
        kernels.jacobi(settings, start)
    };
    compare_solvers(candidate, description, &settings, [fused, staged])
}

/// Some implicit substeps against the reference in double precision.
///
/// Backward Euler with this matrix damps: an error of a velocity is not larger after a solve than
/// before it but for what the springs, not linear, make of it. The bound allows every substep to
/// double the errors so far, and adds those of a solve: the tolerance, and rounding times the
/// condition number of the matrix, in units of the velocities.
///
/// # Errors
/// What is wrong.
pub fn implicit_trajectory(
    candidate: &Candidate,
    description: &Description,
    substeps: usize,
) -> Verdict {
    let tolerance = 50.0 * candidate.epsilon();
    let mut settings = ImplicitSettings::default();
    settings.linear.tolerance = tolerance;
    settings.linear.iterations_max = 2000;
    let mut case = description.case(candidate);
    let mut run = |candidate: &Candidate| -> Result<State> {
        case.config.precision = candidate.precision;
        let mut kernels = case.kernels(candidate)?;
        for number in 0..substeps {
            let mut substep = case.plan.substeps[number % case.plan.substeps.len()];
            substep.length *= 10.0;
            let mut report = SolverReport::default();
            stepper::implicit::substep(&mut *kernels, &substep, &settings, &mut report)?;
        }
        let mut state = State::default();
        kernels.state_read(&mut state)?;
        Ok(state)
    };
    let [found, expected] = [run(candidate)?, run(reference())?];
    let speed = case.state.velocities.iter().flatten().fold(1.0_f64, |m, v| m.max(v.abs()));
    let largest = expected.positions.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let growth = 2.0_f64.powi(substeps as i32);
    let bound = growth * (40.0 * tolerance * speed + 4.0 * candidate.epsilon() * largest);
    // Positions follow the velocities, through times that are less than a second together.
    let velocities = found.velocities.iter().zip(&expected.velocities);
    let positions = found.positions.iter().zip(&expected.positions);
    for (i, (found, expected)) in velocities.chain(positions).enumerate() {
        let error = (0..3).fold(0.0_f64, |m, k| m.max((found[k] - expected[k]).abs()));
        // Written so that NaN fails.
        let within = error <= bound;
        ensure(within, || {
            format!("{}: number {i} is off by {error:e} of {bound:e}", candidate.label)
        })?;
    }
    Ok(())
}
