//! Forces on single particles.

use cloth_core::{
    Control, Frame, ImplicitSettings, Integrator, Kernels, SemiImplicitSettings, SolverConfig,
    State,
};

use crate::{
    Verdict,
    backends::Candidate,
    bits::first_difference,
    models::{Description, RandomForces},
    stages,
    verdict::ensure,
};

fn state_of(kernels: &mut dyn Kernels) -> cloth_core::Result<State> {
    let mut state = State::default();
    kernels.state_read(&mut state)?;
    Ok(state)
}

/// `control_forces` against NUMERICS §3, twice, as the second kick starts from the first one; then taken back: the bits of
/// before the last kick, even where the state was kept after it.
///
/// # Errors
/// What is wrong.
pub fn control_forces(
    candidate: &Candidate,
    description: &Description,
    forces: &RandomForces,
) -> Verdict {
    let case = description.case(candidate);
    let forces = forces.of(case.model.particle_count());
    let mut kernels = case.kernels(candidate)?;
    kernels.control_forces_write(&forces)?;
    ensure(kernels.has_control_forces(), || format!("{}: no forces", candidate.label))?;
    let mut expected = case.particles();
    let mut before = State::default();
    for substep in &case.plan.substeps[..2] {
        before = state_of(&mut *kernels)?;
        kernels.control_forces(substep)?;
        let given = &case.state.positions;
        stages::control_forces(&case.model, &mut expected, &forces, given, substep);
        super::motion::compare_state(candidate, &expected, &mut *kernels)?;
    }
    kernels.state_keep()?;
    kernels.state_restore()?;
    kernels.control_forces_restore()?;
    let difference = first_difference(&before, &state_of(&mut *kernels)?);
    ensure(difference.is_none(), || {
        format!("{}: particle {difference:?} was not taken back", candidate.label)
    })?;
    kernels.control_forces_write(&[])?;
    ensure(!kernels.has_control_forces(), || format!("{}: forces are left", candidate.label))
}

/// Substeps of `explicit_substep` after a kick each, against the plain loops, as [`super::trajectory`].
///
/// # Errors
/// What is wrong.
pub fn control_forces_trajectory(
    candidate: &Candidate,
    description: &Description,
    substeps: usize,
) -> Verdict {
    let case = description.case(candidate);
    let forces = RandomForces::of_seed(description.seed, case.model.particle_count());
    let mut kernels = case.kernels(candidate)?;
    kernels.control_forces_write(&forces)?;
    let mut expected = case.particles();
    for number in 0..substeps {
        let substep = &case.plan.substeps[number % case.plan.substeps.len()];
        kernels.control_forces(substep)?;
        kernels.explicit_substep(substep)?;
        let given = &case.state.positions;
        stages::control_forces(&case.model, &mut expected, &forces, given, substep);
        let (model, config, plan) = (&case.model, &case.config, &case.plan);
        stages::explicit_substep(model, config, &mut expected, plan, substep);
    }
    super::motion::compare_state(candidate, &expected, &mut *kernels)
}

/// Frames of one substep under forces, which go on from the first one, and anchors that move, against one frame of as many
/// substeps: the same but for the rounding of offsets, whatever of it runs together, with every integrator.
///
/// # Errors
/// What is wrong.
pub fn control_forces_frames(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let forces = RandomForces::of_seed(description.seed, case.model.particle_count());
    let mut implicit = ImplicitSettings::default();
    // The first substep of a frame has nothing to start from.
    implicit.linear.warm_start = false;
    let mut newton = implicit;
    newton.newton.iterations_max = 2;
    for integrator in [
        Integrator::Explicit,
        Integrator::Implicit(implicit),
        Integrator::Implicit(newton),
        Integrator::SemiImplicit(SemiImplicitSettings::default()),
    ] {
        let h = case.config.time_step;
        let config = SolverConfig { integrator, strain_bound: f64::MAX, ..case.config.clone() };
        let run = |frames: &[u32]| -> Result<State, crate::verdict::Failure> {
            let mut solver = candidate.backend.create_solver(case.model.clone(), &config)?;
            solver.upload(&case.state)?;
            let mut done = 0;
            for &count in frames {
                done += count;
                let offset = [0.01 * f64::from(done), 0.0, -0.02 * f64::from(done)];
                let forces = (done == count).then(|| forces.clone());
                let control = Control { forces, anchor_offset: Some(offset), ..Control::default() };
                solver.set_control(&control)?;
                solver.advance(Frame { duration: f64::from(count) * h })?;
            }
            solver.synchronize()?;
            let mut state = State::default();
            solver.download(&mut state)?;
            Ok(state)
        };
        let [whole, parts] = [run(&[4])?, run(&[1, 1, 1, 1])?];
        let far = first_far(&whole, &parts, 1e4 * candidate.epsilon());
        ensure(far.is_none(), || {
            let i = far.unwrap_or_default();
            let of = |state: &State| (state.positions[i], state.velocities[i]);
            let label = &candidate.label;
            format!(
                "{label} {:?}: particle {i}: {:?}, {:?}",
                config.integrator,
                of(&whole),
                of(&parts)
            )
        })?;
    }
    Ok(())
}

/// A particle of which two states differ by more than this share of the largest position or velocity.
fn first_far(a: &State, b: &State, share: f64) -> Option<usize> {
    let largest =
        |vectors: &[[f64; 3]]| vectors.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    let far = |a: &[[f64; 3]], b: &[[f64; 3]]| {
        let bound = share * largest(a);
        a.iter().zip(b).position(|(a, b)| (0..3).any(|k| (a[k] - b[k]).abs() > bound))
    };
    far(&a.positions, &b.positions).or_else(|| far(&a.velocities, &b.velocities))
}
