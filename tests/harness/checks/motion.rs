//! Stages that change positions and velocities.

use cloth_core::{Kernels, SpringColouring, State};

use crate::{
    Verdict,
    backends::Candidate,
    models::{Case, Description},
    stages::{self, Particles},
    tracked::TrackedVector,
    verdict::compare,
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
    stages::contact_impulses(
        &case.model,
        &mut expected,
        case.substep().length,
        candidate.epsilon(),
    );
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
        let mut expected = Particles::new(&case.model, &state);
        strain_limit_expected(&case, &mut expected, colour, candidate.epsilon());
        kernels.strain_limit(&case.substep(), colour)?;
        compare_state(candidate, &expected, &mut *kernels)?;
    }
    Ok(())
}

fn strain_limit_expected(case: &Case, expected: &mut Particles, colour: usize, epsilon: f64) {
    let Some(limit) = &case.config.strain_limit else { return };
    let model = &case.model;
    let colouring =
        SpringColouring::greedy(model.springs(), model.particle_count(), &limit.classes);
    let springs = colouring.colour(colour);
    let time_step = case.substep().length;
    stages::strain_limit(model, expected, springs, limit.ratio, time_step, epsilon);
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
    stages::collider_response(&case.model, &mut expected, colliders, candidate.epsilon());
    compare_state(candidate, &expected, &mut *kernels)
}
