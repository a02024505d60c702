//! The matrix of the implicit step is symmetric and positive definite, whatever the state.

use cloth_core::{Air, ContactResponse, Field, ModelBuilder, SelfContact};
use harness::{
    backends::{Candidate, candidates_with},
    dense::Dense,
    feature::Feature,
    random::Random,
};

use crate::{
    implicit_rig::{Shape, assemble, kernels, matrix, network, random_state},
    rig::build,
};

/// Random states for each precision.
const STATES: usize = 10_000;
/// States that share a model, of which the making costs most.
const STATES_OF_A_MODEL: usize = 50;

/// Springs, fields, and contact that acts through forces.
fn check(candidate: &Candidate, random: &mut Random) {
    let particles = 4 + random.index(9) as u32;
    let mut builder = ModelBuilder::new().cloth(network(particles, random));
    if random.chance(0.5) {
        let rate = [0, 1, 2].map(|_| random.between(0.0, 3.0));
        builder = builder.field(Field::Drag { rate }).air(Air::with_wind(random.vector(5.0)));
    }
    if random.chance(0.5) {
        let response = ContactResponse::Penalty {
            stiffness: random.logarithmic(1.0, 1e3),
            damping: random.between(0.0, 0.1),
        };
        builder = builder.self_contact(SelfContact { distance: 0.05, response });
    }
    let model = build(builder);
    let length = random.logarithmic(1e-3, 1.0 / 30.0);
    let first = candidate.rounded(&model.initial_state());
    let (mut kernels, substep) = kernels(candidate, &model, &first, length);
    for number in 0..STATES_OF_A_MODEL {
        let shape = Shape::ALL[number % Shape::ALL.len()];
        let state = candidate.rounded(&random_state(&model, shape, random));
        kernels.state_write(&state).unwrap();
        assemble(&mut *kernels, &substep);
        let dense = Dense::from_blocks(&matrix(&mut *kernels), model.particle_count());
        // Both triangles come from the same numbers.
        assert_eq!(dense.asymmetry(), 0.0, "{} {shape:?}", candidate.label);
        assert_definite(candidate, &dense, &state, shape);
    }
}

/// In double precision Cholesky succeeds. In single precision the entries are rounded, by no more
/// than eps times the diagonal for each spring of a particle: with that added it has to succeed.
fn assert_definite(candidate: &Candidate, dense: &Dense, state: &cloth_core::State, shape: Shape) {
    let mut shifted = dense.clone();
    let rounding = 16.0 * candidate.epsilon();
    for row in 0..dense.size() {
        let size: f64 = dense.row(row).iter().map(|entry| entry.abs()).sum();
        *shifted.at(row, row) += rounding * size;
    }
    assert!(shifted.cholesky().is_some(), "{} {shape:?}: {state:?}", candidate.label);
}

#[test]
fn ten_thousand_random_states_have_a_matrix_that_is_symmetric_and_positive_definite() {
    for candidate in candidates_with(Feature::Implicit) {
        let mut random = Random::new(2003);
        for _ in 0..candidate.work((STATES / STATES_OF_A_MODEL) as u32) {
            check(candidate, &mut random);
        }
    }
}
