//! The composite stages, and whole substeps.

use cloth_core::{
    Frame, ImplicitSettings, Integrator, Kernels, LinearOutcome, LinearSettings, LinearStart,
    LinearVector, Preconditioner, Result, SolverConfig, SolverReport, State,
    stepper::{self, FramePlan, FrameSpan},
};

use super::prepared::Prepared;
use crate::{
    Verdict,
    backends::{Candidate, SAFETY, reference},
    bits::first_difference,
    models::Description,
    tracked::TrackedVector,
    verdict::{ensure, same_solve},
};

type Solve = fn(&mut dyn Kernels, &LinearSettings, LinearStart) -> Result<LinearOutcome>;

/// How far a fused solver whose scalars are in single precision may be from its stages after some
/// iterations, relative to the largest component: rounding grows in every one of them.
const SCALARS_ROUNDING: f64 = 3e-4;
/// Iterations in which it does not grow further.
const SCALARS_ITERATIONS: u32 = 6;

/// A fused solver and its stages say the same, to rounding.
fn compare_rounded(candidate: &Candidate, results: &[(LinearOutcome, Vec<[f64; 3]>)]) -> Verdict {
    let [(fused, fused_y), (staged, staged_y)] = [&results[0], &results[1]];
    let largest = staged_y.iter().flatten().fold(0.0_f64, |m, y| m.max(y.abs()));
    let both = fused_y.iter().flatten().zip(staged_y.iter().flatten());
    let difference = both.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    // Written so that NaN fails.
    let within = difference <= SCALARS_ROUNDING * largest;
    ensure(within && fused.iterations == staged.iterations, || {
        format!("{}: {difference:e} of {largest:e}: {fused:?}, {staged:?}", candidate.label)
    })
}

/// Two solvers give the same bits and say the same of them, from both starts.
fn compare_solvers(
    candidate: &Candidate,
    description: &Description,
    settings: &LinearSettings,
    solvers: [Solve; 2],
) -> Verdict {
    let mut settings = *settings;
    if candidate.single_scalars {
        settings.tolerance = 0.0;
        settings.iterations_max = SCALARS_ITERATIONS;
    }
    let settings = &settings;
    for start in [LinearStart::Constraints, LinearStart::Solution] {
        let mut results = Vec::new();
        for solve in solvers {
            let mut prepared = Prepared::at_start(candidate, description)?;
            prepared.kernels.preconditioner_build(settings.preconditioner)?;
            prepared.fill(candidate, LinearVector::Solution)?;
            let outcome = solve(&mut *prepared.kernels, settings, start)?;
            results.push((outcome, prepared.read(LinearVector::Solution)?));
        }
        if candidate.single_scalars {
            compare_rounded(candidate, &results)?;
            continue;
        }
        let [(fused, fused_y), (staged, staged_y)] = [&results[0], &results[1]];
        ensure(same_solve(fused, staged), || {
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

/// The linear system solved, against NUMERICS §5: the residual that is left is within the tolerance,
/// and constraints are met. As no eigenvalue of A is smaller than the smallest mass, a residual r
/// means an error of at most |r| / mass: all solvers then agree on the solution.
///
/// The bound allows for rounding in every iteration: the residual that an iteration carries along
/// drifts away from the true one by no more than that.
///
/// # Errors
/// What is wrong.
pub fn linear_solution(
    candidate: &Candidate,
    description: &Description,
    settings: &LinearSettings,
) -> Verdict {
    let mut prepared = Prepared::at_start(candidate, description)?;
    // Rounding keeps the conjugate gradient method from residuals that are much smaller.
    let tolerance = 1e4 * candidate.epsilon();
    let settings = LinearSettings { tolerance, iterations_max: 5000, ..*settings };
    let LinearSettings { method, preconditioner, matrix, .. } = settings;
    let label = format!("{}, {method}, {preconditioner}, {matrix}", candidate.label);
    let solver = method.solver::<dyn Kernels>();
    solver.prepare(&mut *prepared.kernels, &settings)?;
    let outcome = solver.solve(&mut *prepared.kernels, &settings, LinearStart::Constraints)?;
    ensure(outcome.converged && !outcome.breakdown, || format!("{label}: {outcome:?}"))?;
    let found = prepared.read(LinearVector::Solution)?;

    let roundings = SAFETY * candidate.epsilon() * f64::from(1 + outcome.iterations);
    let Prepared { particles, system, constraints, .. } = &prepared;
    let solution: Vec<_> = found.iter().copied().map(TrackedVector::exact).collect();
    let change: Vec<_> =
        constraints.0.iter().zip(&particles.velocities).map(|(c, &v)| c.change(v)).collect();
    // Norms of S (b - A y) and of its errors, where rounding does not decide what S is.
    let residual = |vector: &[TrackedVector]| {
        let image = system.apply(vector);
        let (mut square, mut error) = (0.0, 0.0);
        for (i, constraint) in constraints.0.iter().enumerate() {
            if !particles.uncertain[i] {
                let rest = system.right_side[i] - image[i];
                let rest =
                    if constraint.is_free() { rest } else { constraint.filter().apply(rest) };
                square += rest.0.iter().map(|c| c.value * c.value).sum::<f64>();
                error += rest.0.iter().map(|c| c.error * c.error).sum::<f64>();
            }
        }
        [square.sqrt(), error.sqrt()]
    };
    let [[left, error], [reference, reference_error]] = [residual(&solution), residual(&change)];
    let bound = tolerance * reference + roundings * (error + reference_error);
    // Written so that NaN fails.
    let within = left <= bound;
    ensure(within, || format!("{label}: residual {left:e}, bound {bound:e}"))?;

    for (i, constraint) in constraints.0.iter().enumerate() {
        if particles.uncertain[i] || constraint.is_free() {
            continue;
        }
        let rest = solution[i] - constraint.filter().apply(solution[i]) - change[i];
        let within = rest.0.iter().all(|c| c.value.abs() <= roundings * c.error);
        ensure(within, || {
            format!("{label}: the constraint of particle {i} is missed by {:?}", rest.values())
        })?;
    }
    Ok(())
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
            kernels.implicit_substep(&substep, &settings, &mut report)?;
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

/// A frame of a solver, which may record it without looking at what becomes of its solves, against the same
/// substeps run stage by stage with a look at each solve: the same bits.
///
/// # Errors
/// What is wrong.
pub fn implicit_frame(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut settings = ImplicitSettings::default();
    // As many iterations as a backend does not expect.
    settings.linear.tolerance = 100.0 * candidate.epsilon();
    settings.linear.iterations_max = 500;
    settings.linear.warm_start = description.seed.is_multiple_of(2);
    let config = SolverConfig {
        time_step: 10.0 * case.config.time_step,
        integrator: Integrator::Implicit(settings),
        strain_bound: f64::MAX,
        ..case.config.clone()
    };
    let duration = 2.5 * config.time_step;
    let mut solver = candidate.backend.create_solver(case.model.clone(), &config)?;
    solver.upload(&case.state)?;
    solver.advance(Frame { duration })?;
    let report = solver.synchronize()?;
    let mut recorded = State::default();
    solver.download(&mut recorded)?;

    let mut kernels = candidate.backend.create_kernels(case.model.clone(), &config)?;
    kernels.state_write(&case.state)?;
    let colliders = &case.state.colliders;
    let span = FrameSpan {
        time: case.state.time,
        duration,
        wind_velocity: case.model.air().map_or([0.0; 3], |air| air.wind_velocity),
        anchor_offset: [[0.0; 3]; 2],
        from: colliders,
        to: colliders,
    };
    let mut plan = FramePlan::default();
    plan.refill(&case.model, &span, (0.0, case.state.step), config.time_step);
    kernels.frame_begin(&plan)?;
    let mut expected = SolverReport::default();
    for substep in &plan.substeps {
        stepper::implicit::substep(&mut *kernels, substep, &settings, &mut expected)?;
    }
    let mut staged = State::default();
    kernels.state_read(&mut staged)?;
    let difference = first_difference(&recorded, &staged);
    ensure(difference.is_none(), || {
        format!("{}: differs at particle {difference:?}", candidate.label)
    })?;
    let counts = |report: &SolverReport| {
        (report.solves, report.solves_unconverged, report.iterations, report.newton_iterations)
    };
    ensure(counts(&report.solver) == counts(&expected), || {
        format!("{}: {:?}, expected {expected:?}", candidate.label, report.solver)
    })
}
