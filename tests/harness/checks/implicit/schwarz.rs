//! The preconditioner `schwarz` on models with several levels of groups.

use std::sync::Arc;

use cloth_core::{
    LinearMethod, LinearSettings, LinearStart, LinearStop, LinearVector, NewtonStart,
    Preconditioner,
    stepper::{FramePlan, FrameSpan, Substep, implicit::system},
};

use crate::{
    Verdict,
    backends::Candidate,
    checks::PatchFrames,
    random::Random,
    verdict::{Failure, ensure},
};

/// What a backend makes of a system.
struct Found {
    preconditioned: Vec<[f64; 3]>,
    solution: Vec<[f64; 3]>,
    iterations: u32,
    /// Of solves that end by energy, at z and from an answer to a like question: iterations, estimate.
    by_energy: [(u32, f64); 2],
    /// As `preconditioned`, of the matrix of a tenth of the step.
    of_short: Vec<[f64; 3]>,
}

fn found(candidate: &Candidate, patch: &PatchFrames) -> Result<Found, Failure> {
    use LinearVector::{Preconditioned, Residual, RightSide, Solution};
    let model = patch.model()?;
    let state = patch.start(&model);
    let mut kernels = candidate.backend.create_kernels(Arc::clone(&model), &patch.config())?;
    let poses: Vec<_> = model.colliders().iter().map(|collider| collider.pose).collect();
    let (mut plan, length) = (FramePlan::default(), patch.time_step());
    let span = FrameSpan {
        time: 0.0,
        duration: length,
        wind_velocity: [0.0; 3],
        anchor_offset: [[0.0; 3]; 2],
        from: &poses,
        to: &poses,
    };
    plan.refill(&model, &span, (0.0, 0), length);
    kernels.state_write(&state)?;
    kernels.frame_begin(&plan)?;
    kernels.state_keep()?;
    system(&mut *kernels, &plan.substeps[0], NewtonStart::StepStart)?;
    let mut random = Random::new(3);
    let vector: Vec<_> = model
        .masses()
        .iter()
        .map(|mass| random.vector(*mass).map(|number| f64::from(number as f32)))
        .collect();
    kernels.vector_write(Residual, &vector)?;
    kernels.constraint_filter(Residual)?;
    kernels.preconditioner_build(Preconditioner::Schwarz)?;
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    let mut found = Found {
        preconditioned: Vec::new(),
        solution: Vec::new(),
        iterations: 0,
        by_energy: [(0, 0.0); 2],
        of_short: Vec::new(),
    };
    kernels.vector_read(Preconditioned, &mut found.preconditioned)?;
    kernels.vector_combine((1.0, Residual), (0.0, RightSide))?;
    let settings = LinearSettings {
        method: LinearMethod::ConjugateGradient,
        preconditioner: Preconditioner::Schwarz,
        tolerance: 1e-3,
        iterations_max: 500,
        ..LinearSettings::default()
    };
    let outcome = kernels.conjugate_gradient(&settings, LinearStart::Constraints)?;
    ensure(outcome.converged && !outcome.restarted, || {
        format!("{}: {outcome:?}", candidate.label)
    })?;
    found.iterations = outcome.iterations;
    kernels.vector_read(Solution, &mut found.solution)?;
    let settings = LinearSettings { stop: LinearStop::Energy, ..settings };
    let starts = [(LinearStart::Constraints, 1e-2), (LinearStart::Solution, 1e-4)];
    for ((start, tolerance), of_energy) in starts.into_iter().zip(&mut found.by_energy) {
        // The second answer is twice the first one.
        let settings = LinearSettings { tolerance, ..settings };
        let outcome = kernels.conjugate_gradient(&settings, start)?;
        ensure(outcome.converged, || format!("{}: {outcome:?}", candidate.label))?;
        *of_energy = (outcome.iterations, outcome.energy.unwrap_or(f64::NAN));
        kernels.vector_combine((1.0, RightSide), (1.0, RightSide))?;
    }
    let short = Substep { length: 0.1 * length, ..plan.substeps[0] };
    system(&mut *kernels, &short, NewtonStart::StepStart)?;
    kernels.vector_write(Residual, &vector)?;
    kernels.constraint_filter(Residual)?;
    kernels.preconditioner_forget();
    kernels.preconditioner_build(Preconditioner::Schwarz)?;
    kernels.preconditioner_apply(Residual, Preconditioned)?;
    kernels.vector_read(Preconditioned, &mut found.of_short)?;
    // It would be that of before.
    ensure(apart(&found.preconditioned, &found.of_short) > 0.1, || {
        format!("{}: what was forgotten is there", candidate.label)
    })?;
    Ok(found)
}

/// The largest difference of two lists of vectors, relative to the largest component.
fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let largest = a.iter().flatten().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let both = a.iter().flatten().zip(b.iter().flatten());
    both.fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / largest
}

/// The preconditioner and a solve with it by two backends: vectors within `tolerances` of the largest component of each other, as many
/// iterations but for one in twenty.
///
/// # Errors
/// What is wrong.
pub fn schwarz_of_many_groups(
    candidates: [&Candidate; 2],
    patch: &PatchFrames,
    tolerances: [f64; 2],
) -> Verdict {
    let label = &candidates[1].label;
    let _turn = candidates[1].turn();
    let [expected, given] = [found(candidates[0], patch)?, found(candidates[1], patch)?];
    let preconditioned = apart(&expected.preconditioned, &given.preconditioned);
    let solution = apart(&expected.solution, &given.solution);
    let of_short = apart(&expected.of_short, &given.of_short);
    println!(
        "{label}: preconditioned {preconditioned:.1e} and {of_short:.1e}, solution {solution:.1e} apart, {} and {} iterations, by energy {:?}",
        expected.iterations, given.iterations, given.by_energy
    );
    // Written so that NaN fails.
    let is_near = preconditioned <= tolerances[0] && of_short <= tolerances[0];
    ensure(is_near && solution <= tolerances[1], || {
        format!(
            "{label}: preconditioned {preconditioned:e}, {of_short:e}, solution {solution:e} apart"
        )
    })?;
    let more = given.iterations.abs_diff(expected.iterations);
    ensure(20 * more <= expected.iterations + 19, || {
        format!("{label}: {} iterations, not {}", given.iterations, expected.iterations)
    })?;
    let is_near = |((a, x), (b, y)): (&(u32, f64), &(u32, f64))| {
        a.abs_diff(*b) <= u32::from(tolerances[0] > 0.0) && (a != b || (x - y).abs() <= 0.05 * x)
    };
    ensure(expected.by_energy.iter().zip(&given.by_energy).all(is_near), || {
        format!("{label}: by energy {:?}, not {:?}", given.by_energy, expected.by_energy)
    })
}
