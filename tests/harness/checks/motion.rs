//! Stages that change positions and velocities.

use cloth_core::{ColliderImpulse, Colouring, Kernels, SpringColouring, State, stepper};

use crate::{
    Verdict,
    backends::Candidate,
    models::{Case, Description},
    stages::{self, Particles},
    tracked::TrackedVector,
    verdict::{compare, ensure},
};

/// Compares the state of the kernels with what the plain loops made.
pub(super) fn compare_state(
    candidate: &Candidate,
    expected: &Particles,
    kernels: &mut dyn Kernels,
) -> Verdict {
    let mut state = State::default();
    kernels.state_read(&mut state)?;
    let Particles { positions, velocities, uncertain, .. } = expected;
    compare(candidate, "position", positions, &state.positions, uncertain)?;
    compare(candidate, "velocity", velocities, &state.velocities, uncertain)
}

/// `integrate_explicit` against NUMERICS §4, with the forces that the candidate itself computed.
///
/// # Errors
/// What is wrong.
pub fn integrate_explicit(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.field_forces()?;
    kernels.spring_forces()?;
    let mut forces = Vec::new();
    kernels.forces_read(&mut forces)?;
    kernels.integrate_explicit(&case.substep())?;
    let forces: Vec<_> = forces.into_iter().map(TrackedVector::exact).collect();
    let mut expected = case.particles();
    stages::integrate_explicit(&mut expected, &forces, case.substep().length);
    compare_state(candidate, &expected, &mut *kernels)
}

/// `contact_impulses` against NUMERICS §8.
///
/// # Errors
/// What is wrong.
pub fn contact_impulses(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.contact_candidates()?;
    kernels.contact_impulses(&case.substep())?;
    let mut expected = case.particles();
    stages::contact_impulses(&case.model, &mut expected, case.substep().length);
    compare_state(candidate, &expected, &mut *kernels)
}

/// `strain_limit` against NUMERICS §4, one colour after the other.
///
/// # Errors
/// What is wrong.
pub fn strain_limit(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    for colour in 0..kernels.strain_limit_colours() {
        // From the state of the candidate, so that each colour is judged alone.
        let mut state = State::default();
        kernels.state_read(&mut state)?;
        let mut expected = Particles::new(&case.model, &state, candidate.epsilon());
        strain_limit_expected(&case, &mut expected, colour);
        kernels.strain_limit(&case.substep(), colour)?;
        compare_state(candidate, &expected, &mut *kernels)?;
    }
    Ok(())
}

fn strain_limit_expected(case: &Case, expected: &mut Particles, colour: usize) {
    let Some(limit) = &case.config.strain_limit else { return };
    let model = &case.model;
    let colouring =
        SpringColouring::greedy(model.springs(), model.particle_count(), &limit.classes);
    let springs = colouring.colour(colour);
    let time_step = case.substep().length;
    stages::strain_limit(model, expected, springs, limit.ratio, time_step);
}

/// `stretch_limit` against NUMERICS §4, one colour after the other.
///
/// # Errors
/// What is wrong.
pub fn stretch_limit(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    let (model, limit) = (&case.model, case.config.strain_limit.as_ref());
    let colouring = Colouring::of_triangles(model.elements().triangles(), model.particle_count());
    let colours = if limit.is_some() { colouring.len() } else { 0 };
    ensure(kernels.stretch_limit_colours() == colours, || {
        format!("{}: {} colours", candidate.label, kernels.stretch_limit_colours())
    })?;
    let substep = case.substep();
    for colour in 0..colours {
        let mut state = State::default();
        kernels.state_read(&mut state)?;
        let mut expected = Particles::new(model, &state, candidate.epsilon());
        let (triangles, ratio) = (colouring.colour(colour), limit.map_or(1.0, |limit| limit.ratio));
        stages::stretch_limit(model, &mut expected, triangles, ratio, substep.length);
        kernels.stretch_limit(&substep, colour)?;
        compare_state(candidate, &expected, &mut *kernels)?;
    }
    Ok(())
}

/// `collider_response` against NUMERICS §7.
///
/// # Errors
/// What is wrong.
pub fn collider_response(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.collider_response(&case.substep())?;
    let colliders = case.plan.colliders_at(case.substep().index);
    let mut expected = case.particles();
    let stayed = expected.positions.clone();
    let start = Some((&stayed[..], case.substep().length));
    stages::collider_response(&case.model, &mut expected, colliders, start);
    compare_state(candidate, &expected, &mut *kernels)
}

/// `collider_impulses` against NUMERICS §7: what one response did to particles that rounding leaves no choice, nothing
/// when asked again, and the same through a frame of fused substeps as through their stages.
///
/// # Errors
/// What is wrong.
pub fn collider_impulses(candidate: &Candidate, description: &Description) -> Verdict {
    // Models of even seeds ask for impulses.
    let description = Description { seed: description.seed & !1, ..description.clone() };
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    let mut found = Vec::new();
    kernels.collider_response(&case.substep())?;
    kernels.collider_impulses(&mut found)?;
    let colliders = case.plan.colliders_at(case.substep().index);
    let mut particles = case.particles();
    let stayed = particles.positions.clone();
    let start = Some((&stayed[..], case.substep().length));
    let expected = stages::collider_response(&case.model, &mut particles, colliders, start);
    if !particles.uncertain.contains(&true) {
        let parts = |part: usize| expected.iter().map(|sums| sums[part]).collect::<Vec<_>>();
        let linear: Vec<_> = found.iter().map(|sum| sum.linear).collect();
        compare(candidate, "impulse of collider", &parts(0), &linear, &[])?;
        let angular: Vec<_> = found.iter().map(|sum| sum.angular).collect();
        compare(candidate, "moment of collider", &parts(1), &angular, &[])?;
    }
    kernels.collider_impulses(&mut found)?;
    ensure(found == vec![ColliderImpulse::default(); colliders.len()], || {
        format!("{}: impulses are left after they were taken: {found:?}", candidate.label)
    })?;
    kernels.state_keep()?;
    kernels.collider_response(&case.substep())?;
    kernels.state_restore()?;
    kernels.collider_impulses(&mut found)?;
    ensure(found == vec![ColliderImpulse::default(); colliders.len()], || {
        format!("{}: impulses of what was taken back: {found:?}", candidate.label)
    })?;
    let [mut fused, mut staged] = [case.kernels(candidate)?, case.kernels(candidate)?];
    for substep in &case.plan.substeps {
        fused.explicit_substep(substep)?;
        stepper::explicit::substep(&mut *staged, substep)?;
    }
    let mut expected = Vec::new();
    fused.collider_impulses(&mut found)?;
    staged.collider_impulses(&mut expected)?;
    ensure(found == expected, || {
        format!("{}: fused {found:?}, staged {expected:?}", candidate.label)
    })
}
