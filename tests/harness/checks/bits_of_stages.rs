//! Two backends that promise the same bits, stage by stage.

use cloth_core::{
    ColliderImpulse, Kernels, LinearMethod, LinearSettings, LinearStart, LinearVector, MatrixForm,
    NewtonStart, Preconditioner, State,
};

use crate::{
    Verdict,
    backends::Candidate,
    models::{Description, RandomForces},
    verdict::{ensure, same_solve},
};

/// Numbers that are equal; zeros of either sign are, and so are two NaN.
fn same(a: &[[f64; 3]], b: &[[f64; 3]]) -> Option<usize> {
    let equal = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
    let rows = a.iter().zip(b);
    if a.len() != b.len() {
        return Some(a.len().min(b.len()));
    }
    rows.into_iter().position(|(a, b)| (0..3).any(|axis| !equal(a[axis], b[axis])))
}

/// Compares state and forces of two kernels.
fn compare(stage: &str, pair: &mut [Box<dyn Kernels>; 2]) -> Verdict {
    let mut found = [(State::default(), Vec::new()), (State::default(), Vec::new())];
    for (kernels, (state, forces)) in pair.iter_mut().zip(&mut found) {
        kernels.state_read(state)?;
        kernels.forces_read(forces)?;
    }
    let [(a, forces_a), (b, forces_b)] = &found;
    for (what, a, b) in [
        ("position", &a.positions, &b.positions),
        ("velocity", &a.velocities, &b.velocities),
        ("force", forces_a, forces_b),
    ] {
        let difference = same(a, b);
        ensure(difference.is_none(), || {
            let i = difference.unwrap_or_default();
            format!("{stage}: {what} of particle {i}: {:?} and {:?}", a.get(i), b.get(i))
        })?;
    }
    ensure(a.held == b.held, || format!("{stage}: held particles differ"))
}

/// `constraint_impulses`: sums over particles in another order, which single impulses of the same bits let agree but
/// for the rounding of double precision.
fn impulses(pair: &mut [Box<dyn Kernels>; 2], start: NewtonStart) -> Verdict {
    let mut found = [Vec::new(), Vec::new()];
    for (kernels, found) in pair.iter_mut().zip(&mut found) {
        kernels.constraint_impulses(start)?;
        kernels.collider_impulses(found)?;
    }
    let [a, b] = &found;
    let numbers = |sum: &ColliderImpulse| [sum.linear, sum.angular].concat();
    let (a, b): (Vec<_>, Vec<_>) =
        (a.iter().flat_map(numbers).collect(), b.iter().flat_map(numbers).collect());
    let largest = a.iter().fold(0.0_f64, |largest, number| largest.max(number.abs()));
    let is_near =
        |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-11 * largest || a.is_nan() && b.is_nan();
    ensure(a.len() == b.len() && a.iter().zip(&b).all(is_near), || {
        format!("constraint_impulses: {a:?} and {b:?}")
    })
}

/// Speed \[m/s\] beyond which a state has flown apart: one substep with a force that grows with the third power of the
/// speed then takes it to where products overflow, and backends multiply other infinities by zero where a packet
/// has lanes to spare.
const SPEED_MAX: f64 = 1e6;

/// Whether the numbers of a state are still such that all arithmetic with them is.
fn is_moderate(kernels: &mut dyn Kernels) -> cloth_core::Result<bool> {
    let mut state = State::default();
    kernels.state_read(&mut state)?;
    Ok(state.velocities.iter().flatten().all(|speed| speed.abs() < SPEED_MAX))
}

/// Every stage of an explicit substep, and what looks at the state, on both backends.
///
/// # Errors
/// The first difference.
pub fn bits_of_explicit_stages(candidates: [&Candidate; 2], description: &Description) -> Verdict {
    let case = description.case(candidates[0]);
    let mut pair =
        [case.kernels(candidates[0])?, case.kernels(candidates[1])?] as [Box<dyn Kernels>; 2];
    let both = |pair: &mut [Box<dyn Kernels>; 2],
                stage: &str,
                work: &dyn Fn(&mut dyn Kernels) -> cloth_core::Result<()>|
     -> Verdict {
        for kernels in pair.iter_mut() {
            work(&mut **kernels)?;
        }
        compare(stage, pair)
    };
    let forces = RandomForces::of_seed(description.seed, case.model.particle_count());
    for kernels in &mut pair {
        kernels.control_forces_write(&forces)?;
    }
    for substep in &case.plan.substeps {
        if !is_moderate(&mut *pair[0])? {
            break;
        }
        both(&mut pair, "control_forces", &|kernels| kernels.control_forces(substep))?;
        both(&mut pair, "control_forces_restore", &|kernels| kernels.control_forces_restore())?;
        both(&mut pair, "field_forces", &|kernels| kernels.field_forces())?;
        both(&mut pair, "procedural_forces", &|kernels| kernels.procedural_forces(substep))?;
        both(&mut pair, "spring_forces", &|kernels| kernels.spring_forces())?;
        if case.model.has_fabric() {
            both(&mut pair, "membrane_forces", &|kernels| kernels.membrane_forces())?;
            both(&mut pair, "bending_forces", &|kernels| kernels.bending_forces())?;
        }
        if case.model.air().is_some() {
            let stage = "aerodynamic_forces";
            both(&mut pair, stage, &|kernels| kernels.aerodynamic_forces(substep))?;
        }
        if case.model.self_contact().is_some() {
            both(&mut pair, "contact_candidates", &|kernels| kernels.contact_candidates())?;
            if pair[0].contact_is_penalty() {
                both(&mut pair, "contact_forces", &|kernels| kernels.contact_forces())?;
            }
        }
        both(&mut pair, "integrate_explicit", &|kernels| kernels.integrate_explicit(substep))?;
        if case.model.self_contact().is_some() && !pair[0].contact_is_penalty() {
            both(&mut pair, "contact_impulses", &|kernels| {
                kernels.contact_candidates()?;
                kernels.contact_impulses(substep)
            })?;
        }
        for colour in 0..pair[0].strain_limit_colours() {
            both(&mut pair, "strain_limit", &|kernels| kernels.strain_limit(substep, colour))?;
        }
        for colour in 0..pair[0].stretch_limit_colours() {
            both(&mut pair, "stretch_limit", &|kernels| kernels.stretch_limit(substep, colour))?;
        }
        both(&mut pair, "strain_limit_sweeps", &|kernels| kernels.strain_limit_sweeps(substep))?;
        if !case.model.colliders().is_empty() {
            both(&mut pair, "collider_response", &|kernels| kernels.collider_response(substep))?;
        }
        let mut normals = [Vec::new(), Vec::new()];
        let mut measures = Vec::new();
        for (kernels, normals) in pair.iter_mut().zip(&mut normals) {
            kernels.vertex_normals(normals)?;
            measures.push(kernels.measure()?);
        }
        let difference = same(&normals[0], &normals[1]);
        ensure(difference.is_none(), || format!("normal of particle {difference:?}"))?;
        ensure(measures[0] == measures[1], || {
            format!("measure: {:?} and {:?}", measures[0], measures[1])
        })?;
        if !is_moderate(&mut *pair[0])? {
            break;
        }
        both(&mut pair, "explicit_substep", &|kernels| kernels.explicit_substep(substep))?;
    }
    // Many kicks and substeps before anybody looks, as in a frame.
    if is_moderate(&mut *pair[0])? {
        both(&mut pair, "explicit_substep under control_forces", &|kernels| {
            for substep in &case.plan.substeps {
                kernels.control_forces(substep)?;
                kernels.explicit_substep(substep)?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Every stage of an implicit substep, and whole solves, on both backends.
///
/// # Errors
/// The first difference.
pub fn bits_of_implicit_stages(candidates: [&Candidate; 2], description: &Description) -> Verdict {
    use LinearVector::{Image, Preconditioned, Residual, RightSide, Solution};
    let case = description.case(candidates[0]);
    let mut pair =
        [case.kernels(candidates[0])?, case.kernels(candidates[1])?] as [Box<dyn Kernels>; 2];
    let vectors = |pair: &mut [Box<dyn Kernels>; 2], stage: &str, vector| -> Verdict {
        let mut found = [Vec::new(), Vec::new()];
        for (kernels, found) in pair.iter_mut().zip(&mut found) {
            kernels.vector_read(vector, found)?;
        }
        let difference = same(&found[0], &found[1]);
        ensure(difference.is_none(), || {
            let i = difference.unwrap_or_default();
            format!("{stage}: {vector:?} of {i}: {:?} and {:?}", found[0].get(i), found[1].get(i))
        })
    };
    let forces = RandomForces::of_seed(description.seed, case.model.particle_count());
    for kernels in &mut pair {
        kernels.control_forces_write(&forces)?;
    }
    let penalty = pair[0].contact_is_penalty();
    for (number, substep) in case.plan.substeps.iter().enumerate() {
        if !is_moderate(&mut *pair[0])? {
            break;
        }
        let start = if number % 2 == 0 { NewtonStart::StepStart } else { NewtonStart::Iterate };
        for kernels in &mut pair {
            kernels.state_keep()?;
            if !case.model.colliders().is_empty() {
                kernels.collider_constraints(substep)?;
            }
            kernels.field_forces()?;
            kernels.procedural_forces(substep)?;
            if case.model.air().is_some() {
                kernels.aerodynamic_forces(substep)?;
            }
            kernels.spring_linearise(substep)?;
            if case.model.has_fabric() {
                kernels.membrane_linearise(substep, start)?;
                kernels.bending_linearise(substep, start)?;
            }
            if penalty {
                kernels.contact_candidates()?;
                kernels.contact_forces()?;
                kernels.contact_linearise(substep)?;
            }
            kernels.implicit_assemble(substep, start)?;
        }
        vectors(&mut pair, "implicit_assemble", RightSide)?;
        for kernels in &mut pair {
            kernels.control_forces_assemble(substep, start)?;
        }
        vectors(&mut pair, "control_forces_assemble", RightSide)?;
        let mut matrices = [Vec::new(), Vec::new()];
        for (kernels, matrix) in pair.iter_mut().zip(&mut matrices) {
            kernels.matrix_read(matrix)?;
        }
        ensure(matrices[0] == matrices[1], || "the matrices differ".into())?;
        for preconditioner in [Preconditioner::Diagonal, Preconditioner::Block] {
            for kernels in &mut pair {
                kernels.preconditioner_build(preconditioner)?;
                kernels.vector_combine((1.0, RightSide), (0.0, Residual))?;
                kernels.constraint_filter(Residual)?;
                kernels.preconditioner_apply(Residual, Preconditioned)?;
                kernels.matrix_apply(MatrixForm::MatrixFree, Preconditioned, Image)?;
            }
            vectors(&mut pair, "constraint_filter", Residual)?;
            vectors(&mut pair, "preconditioner_apply", Preconditioned)?;
            vectors(&mut pair, "matrix_apply", Image)?;
            let mut dots = Vec::new();
            for kernels in &mut pair {
                dots.push(kernels.vector_dot(Residual, Image)?);
            }
            ensure(dots[0] == dots[1], || format!("vector_dot: {} and {}", dots[0], dots[1]))?;
            for method in [LinearMethod::ConjugateGradient, LinearMethod::Jacobi] {
                for start in [LinearStart::Constraints, LinearStart::Solution] {
                    if method == LinearMethod::Jacobi && preconditioner == Preconditioner::Diagonal
                    {
                        continue;
                    }
                    let settings = LinearSettings {
                        method,
                        preconditioner,
                        iterations_max: 25,
                        tolerance: 1e-6,
                        ..LinearSettings::default()
                    };
                    let mut outcomes = Vec::new();
                    for kernels in &mut pair {
                        outcomes.push(match method {
                            LinearMethod::Jacobi => kernels.jacobi(&settings, start)?,
                            _ => kernels.conjugate_gradient(&settings, start)?,
                        });
                    }
                    ensure(same_solve(&outcomes[0], &outcomes[1]), || {
                        format!("{method:?} {start:?}: {:?} and {:?}", outcomes[0], outcomes[1])
                    })?;
                    vectors(&mut pair, "solve", Solution)?;
                }
            }
        }
        if !case.model.colliders().is_empty() {
            let mut released = Vec::new();
            for kernels in &mut pair {
                released.push(kernels.constraint_release()?);
            }
            ensure(released[0] == released[1], || format!("released: {released:?}"))?;
            vectors(&mut pair, "constraint_release", RightSide)?;
            impulses(&mut pair, start)?;
            for kernels in &mut pair {
                kernels.constraint_project(Solution)?;
            }
            vectors(&mut pair, "constraint_project", Solution)?;
        }
        for kernels in &mut pair {
            kernels.velocity_add(1.0)?;
            kernels.position_from_kept(0.25 * substep.length)?;
            kernels.position_advance(0.75 * substep.length)?;
        }
        compare("implicit motion", &mut pair)?;
    }
    Ok(())
}
