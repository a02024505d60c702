//! Linear and angular momentum of a cloth that nothing holds.

use std::sync::Arc;

use cloth_core::{
    GridPatch, LinearVector, Model, ModelBuilder, SemiImplicitSolve, SolverConfig, State,
    stepper::Substep,
};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates_with},
    feature::Feature,
    models::{grid_cloth, material},
    random::Random,
};

use crate::rig::build;

const LENGTH: f64 = 0.02;

/// Two patches side by side, crumpled, of which the second is held at a corner if asked for.
fn patches(held: bool) -> (Arc<Model>, State) {
    let mut builder = ModelBuilder::new().gravity([0.0; 3]);
    for (name, x) in [("first", 0.0), ("second", 0.6)] {
        let patch = GridPatch { origin: [x, 0.1, 0.3], ..GridPatch::horizontal(9, 0.05, 0.0) };
        let mut cloth = grid_cloth(name, patch, material(2e-3, 20.0, 1e-3));
        cloth.pins = if held && name == "second" { vec![0] } else { Vec::new() };
        builder = builder.cloth(cloth);
    }
    let model = build(builder);
    let mut random = Random::new(5);
    let mut state = model.initial_state();
    for i in 0..state.len() {
        let [dx, dv] = [random.vector(0.02), random.vector(0.5)];
        if state.held[i] == 0 {
            state.positions[i] = std::array::from_fn(|k| state.positions[i][k] + dx[k]);
            state.velocities[i] = dv;
        }
    }
    (model, state)
}

/// The changes of velocity before and after the correction.
fn changes(candidate: &Candidate, model: &Arc<Model>, state: &State) -> [Vec<[f64; 3]>; 2] {
    let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
    let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
    let substep = Substep { length: LENGTH, ..Substep::default() };
    kernels.state_write(state).unwrap();
    kernels.semi_implicit_factorise(LENGTH, SemiImplicitSolve::Factorisation).unwrap();
    kernels.field_forces().unwrap();
    kernels.spring_forces().unwrap();
    kernels.semi_implicit_solve(&substep).unwrap();
    let [mut before, mut after] = [Vec::new(), Vec::new()];
    kernels.vector_read(LinearVector::Solution, &mut before).unwrap();
    kernels.torque_correct(&substep).unwrap();
    kernels.vector_read(LinearVector::Solution, &mut after).unwrap();
    [before, after]
}

/// Linear and angular momentum of the particles `range`, the latter about the origin, and the sums of
/// their magnitudes.
fn momentum(
    model: &Model,
    state: &State,
    changes: &[[f64; 3]],
    range: std::ops::Range<usize>,
) -> ([DVec3; 2], [f64; 2]) {
    let mut sums = ([DVec3::ZERO; 2], [0.0; 2]);
    for i in range {
        let p = model.masses()[i] * DVec3::from(changes[i]);
        let l = DVec3::from(state.positions[i]).cross(p);
        sums.0 = [sums.0[0] + p, sums.0[1] + l];
        sums.1 = [sums.1[0] + p.length(), sums.1[1] + l.length()];
    }
    sums
}

/// Internal forces change neither. The bound: rounding of the forces, of h f, of y, and of the
/// solve, each a few eps of the sum of magnitudes; condition about 1 + 24 h^2 k / m = 100.
#[test]
fn a_free_cloth_keeps_its_momentum_and_with_the_correction_its_angular_momentum() {
    let (model, state) = patches(false);
    for candidate in candidates_with(Feature::SemiImplicit) {
        let state = candidate.rounded(&state);
        let [before, after] = changes(candidate, &model, &state);
        let bound = 100.0 * candidate.epsilon();
        for range in [0..81, 81..162] {
            for changes in [&before, &after] {
                let ([p, _], [p_sum, _]) = momentum(&model, &state, changes, range.clone());
                assert!(p.length() <= bound * p_sum, "{}: momentum {p}", candidate.label);
            }
            let ([_, l], [_, sum]) = momentum(&model, &state, &before, range.clone());
            assert!(l.length() > 1e-3 * sum, "{}: nothing to correct: {l}", candidate.label);
            let ([_, l], [_, sum]) = momentum(&model, &state, &after, range);
            assert!(l.length() <= bound * sum, "{}: angular momentum {l}", candidate.label);
        }
    }
}

#[test]
fn a_cloth_that_is_held_is_not_corrected() {
    let (model, state) = patches(true);
    for candidate in candidates_with(Feature::SemiImplicit) {
        let [before, after] = changes(candidate, &model, &candidate.rounded(&state));
        assert_ne!(before[..81], after[..81], "{}", candidate.label);
        assert_eq!(before[81..], after[81..], "{}", candidate.label);
    }
}
