//! No pair in contact is ever missing.

use std::sync::Arc;

use cloth_core::{
    ContactResponse, GridPatch, Model, ModelBuilder, SelfContact, SolverConfig, State,
};

use crate::{
    Verdict,
    backends::Candidate,
    models::{Description, grid_cloth, material},
    random::Random,
    stages::{self, Particles},
    tracked::TrackedVector,
    verdict::{compare, ensure},
};

/// Compares pairs with those found by trying all; pairs for which rounding decides may differ.
fn compare_pairs(
    candidate: &Candidate,
    model: &Model,
    state: &State,
    found: &[[u32; 2]],
    when: &str,
) -> Verdict {
    let mut particles = Particles::new(model, state, candidate.epsilon());
    let expected = stages::contact_pairs(model, &mut particles);
    ensure(found.is_sorted_by(|a, b| a < b), || format!("{when}: pairs are not ascending"))?;
    let is_certain = |pair: &&[u32; 2]| !expected.uncertain.contains(pair);
    for pair in expected.pairs.iter().filter(is_certain) {
        ensure(found.binary_search(pair).is_ok(), || {
            format!("{} {when}: pair {pair:?} is missing", candidate.label)
        })?;
    }
    for pair in found.iter().filter(is_certain) {
        ensure(expected.pairs.binary_search(pair).is_ok(), || {
            format!("{} {when}: pair {pair:?} is not in contact", candidate.label)
        })?;
    }
    Ok(())
}

/// The pairs of a fresh state.
///
/// # Errors
/// What is wrong.
pub fn contact_candidates(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    kernels.contact_candidates()?;
    let mut found = Vec::new();
    kernels.contact_pairs_read(&mut found)?;
    compare_pairs(candidate, &case.model, &case.state, &found, "at the start")
}

/// The pairs while particles are moved about at random, by so much or so little that the list is used
/// again, repaired or built anew.
///
/// # Errors
/// What is wrong.
pub fn contact_candidates_after_moves(
    candidate: &Candidate,
    description: &Description,
    moves: usize,
) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    let mut random_moves = Moves { random: Random::new(description.seed), away: None };
    let mut state = case.state.clone();
    let mut found = Vec::new();
    for number in 0..moves {
        random_moves.apply(&mut state.positions);
        state = candidate.rounded(&state);
        kernels.state_write(&state)?;
        kernels.contact_candidates()?;
        kernels.contact_pairs_read(&mut found)?;
        compare_pairs(candidate, &case.model, &state, &found, &format!("after move {number}"))?;
    }
    Ok(())
}

/// Moves of every kind that a list of candidates has to survive.
struct Moves {
    random: Random,
    /// Where the later half of the particles is, relative to the rest shape, if it was sent away.
    away: Option<[f64; 3]>,
}

impl Moves {
    /// Jitters everything, shifts everything, or one particle, or half of all; or sends that half
    /// some metres away and, the next time, back again.
    fn apply(&mut self, positions: &mut [[f64; 3]]) {
        let random = &mut self.random;
        let size = random.logarithmic(1e-5, 0.3);
        let shift = random.vector(size);
        let chosen = random.index(positions.len());
        let half = positions.len() / 2;
        match random.index(5) {
            0 => positions.iter_mut().for_each(|x| *x = sum(*x, random.vector(0.1 * size))),
            1 => positions.iter_mut().for_each(|x| *x = sum(*x, shift)),
            2 => positions[chosen] = sum(positions[chosen], shift),
            3 => positions[half..].iter_mut().for_each(|x| *x = sum(*x, shift)),
            _ => {
                let step = match self.away.take() {
                    Some(away) => away.map(|component| -component),
                    None => *self.away.insert(random.direction().map(|c| 4.0 * c)),
                };
                positions[half..].iter_mut().for_each(|x| *x = sum(*x, step));
            }
        }
    }
}

/// The pairs while one sheet moves towards another, in small steps and from a distance of `gap`
/// contact distances: the list was made when no particle of one was near any of the other.
///
/// # Errors
/// What is wrong.
pub fn contact_candidates_of_approaching_sheets(candidate: &Candidate, gap: f64) -> Verdict {
    let distance = 0.02;
    // Enough particles that a search by groups of them has groups in one sheet alone.
    let side = 16;
    let sheet = |name, height| {
        grid_cloth(name, GridPatch::horizontal(side, distance, height), material(1e-3, 1.0, 1e-3))
    };
    let response = ContactResponse::Penalty { stiffness: 1.0, damping: 0.0 };
    let model = ModelBuilder::new()
        .cloth(sheet("low", 0.0))
        .cloth(sheet("high", gap * distance))
        .self_contact(SelfContact { distance, response })
        .build()
        .map_err(cloth_core::Error::from)?;
    let model = Arc::new(model);
    let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
    let mut kernels = candidate.backend.create_kernels(model.clone(), &config)?;
    let mut state = candidate.rounded(&model.initial_state());
    let mut found = Vec::new();
    // Past each other, so that pairs also leave.
    let steps = ((gap + 2.0) / 0.23) as usize;
    for number in 0..steps {
        kernels.state_write(&state)?;
        kernels.contact_candidates()?;
        kernels.contact_pairs_read(&mut found)?;
        compare_pairs(candidate, &model, &state, &found, &format!("gap {gap}, step {number}"))?;
        for x in &mut state.positions[(side * side) as usize..] {
            *x = sum(*x, [0.011 * distance, 0.007 * distance, -0.23 * distance]);
        }
        state = candidate.rounded(&state);
    }
    Ok(())
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

/// The pairs, and the forces or impulses made from them, through substeps in which the list is used
/// again and again.
///
/// # Errors
/// What is wrong.
pub fn contact_candidates_reused(
    candidate: &Candidate,
    description: &Description,
    substeps: usize,
) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    let mut state = State::default();
    for number in 0..substeps {
        let when = format!("after substep {number}");
        kernels.explicit_substep(&case.plan.substeps[number % case.plan.substeps.len()])?;
        kernels.state_read(&mut state)?;
        let mut particles = Particles::new(&case.model, &state, candidate.epsilon());
        if kernels.contact_is_penalty() {
            kernels.field_forces()?;
            let mut fields = Vec::new();
            kernels.forces_read(&mut fields)?;
            kernels.contact_candidates()?;
            kernels.contact_forces()?;
            let mut expected: Vec<_> = fields.into_iter().map(TrackedVector::exact).collect();
            stages::contact_forces(&case.model, &mut particles, &mut expected);
            let mut found = Vec::new();
            kernels.forces_read(&mut found)?;
            compare(candidate, "contact force", &expected, &found, &particles.uncertain)?;
        } else {
            kernels.contact_candidates()?;
            kernels.contact_impulses(&case.substep())?;
            stages::contact_impulses(&case.model, &mut particles, case.substep().length);
            super::motion::compare_state(candidate, &particles, &mut *kernels)?;
            kernels.state_read(&mut state)?;
        }
        let mut found = Vec::new();
        kernels.contact_pairs_read(&mut found)?;
        compare_pairs(candidate, &case.model, &state, &found, &when)?;
    }
    Ok(())
}
