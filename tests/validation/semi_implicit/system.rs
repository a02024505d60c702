//! The change of velocity against a dense solve, and against the dense inverse.

use std::sync::Arc;

use cloth_core::{
    GridPatch, Kernels, LinearVector, Model, ModelBuilder, Precision, SemiImplicitSolve,
    SolverConfig, State, Stencil, stepper::Substep,
};
use harness::{
    backends::{Candidate, candidates_with},
    feature::Feature,
    models::{grid_cloth, material},
    random::Random,
};

use crate::rig::build;

const LENGTH: f64 = 1.0 / 60.0;

/// A patch of 13 x 13 particles with springs of stiffness 10 N/m, held at a corner.
fn patch() -> (Arc<Model>, State) {
    let mut fabric = material(1e-3, 10.0, 1e-3);
    fabric.stretch.damping = 5e-3;
    let patch =
        GridPatch { stencil: Stencil::Neighbours24, ..GridPatch::horizontal(13, 0.02, 0.0) };
    let mut cloth = grid_cloth("patch", patch, fabric);
    cloth.pins = vec![0];
    let model = build(ModelBuilder::new().cloth(cloth));
    let mut random = Random::new(11);
    let mut state = model.initial_state();
    for (x, v) in state.positions.iter_mut().zip(&mut state.velocities).skip(1) {
        let [dx, dv] = [random.vector(0.004), random.vector(0.5)];
        *x = std::array::from_fn(|k| x[k] + dx[k]);
        *v = dv;
    }
    (model, state)
}

fn solution(
    candidate: &Candidate,
    model: &Arc<Model>,
    state: &State,
    solve: SemiImplicitSolve,
) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
    let mut kernels: Box<dyn Kernels> =
        candidate.backend.create_kernels(model.clone(), &config).unwrap();
    kernels.state_write(state).unwrap();
    kernels.semi_implicit_factorise(LENGTH, solve).unwrap();
    kernels.field_forces().unwrap();
    kernels.spring_forces().unwrap();
    kernels.semi_implicit_solve(&Substep { length: LENGTH, ..Substep::default() }).unwrap();
    let [mut forces, mut solution] = [Vec::new(), Vec::new()];
    kernels.forces_read(&mut forces).unwrap();
    kernels.vector_read(LinearVector::Solution, &mut solution).unwrap();
    (forces, solution)
}

/// The system of NUMERICS §6 as a dense matrix, solved by elimination without pivoting, which needs
/// none.
fn dense_solution(model: &Model, state: &State, forces: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let count = model.particle_count();
    let mut matrix = vec![vec![0.0; count]; count];
    let mut right_side: Vec<[f64; 3]> = forces.iter().map(|f| f.map(|c| LENGTH * c)).collect();
    for (i, (row, &mass)) in matrix.iter_mut().zip(model.masses()).enumerate() {
        row[i] = mass;
    }
    for spring in model.springs().iter() {
        let kind = model.springs().kinds()[spring.kind as usize];
        let weight = LENGTH * LENGTH * kind.stiffness + LENGTH * kind.damping;
        let [a, b] = spring.particles.map(|particle| particle as usize);
        for (i, j) in [(a, b), (b, a)] {
            matrix[i][i] += weight;
            matrix[i][j] -= weight;
            for (k, entry) in right_side[i].iter_mut().enumerate() {
                let difference = state.velocities[j][k] - state.velocities[i][k];
                *entry += LENGTH * LENGTH * kind.stiffness * difference;
            }
        }
    }
    for i in (0..count).filter(|&i| state.held[i] != 0) {
        matrix[i].fill(0.0);
        matrix.iter_mut().for_each(|row| row[i] = 0.0);
        matrix[i][i] = 1.0;
        right_side[i] = [0.0; 3];
    }
    for pivot in 0..count {
        let (above, below) = matrix.split_at_mut(pivot + 1);
        let pivot_row = &above[pivot];
        for (row, values) in below.iter_mut().enumerate() {
            let factor = values[pivot] / pivot_row[pivot];
            for column in pivot..count {
                values[column] -= factor * pivot_row[column];
            }
            let known = right_side[pivot];
            for (entry, known) in right_side[pivot + 1 + row].iter_mut().zip(known) {
                *entry -= factor * known;
            }
        }
    }
    for row in (0..count).rev() {
        let (above, known) = right_side.split_at_mut(row + 1);
        for (k, entry) in above[row].iter_mut().enumerate() {
            let products = known.iter().zip(&matrix[row][row + 1..]).map(|(y, a)| a * y[k]);
            *entry = (*entry - products.sum::<f64>()) / matrix[row][row];
        }
    }
    right_side
}

fn largest_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Both solves, in both precisions. The condition of the system, about 1 + 24 (h^2 k + h c) / m times
/// two, is 170.
#[test]
fn the_constant_system_is_solved_to_rounding() {
    let (model, state) = patch();
    for candidate in candidates_with(Feature::SemiImplicit) {
        let state = candidate.rounded(&state);
        for solve in [SemiImplicitSolve::Factorisation, SemiImplicitSolve::DenseInverse] {
            let is_dense = solve == SemiImplicitSolve::DenseInverse;
            if is_dense && !candidate.offers(Feature::DenseInverse) {
                continue;
            }
            let (forces, found) = solution(candidate, &model, &state, solve);
            let expected = dense_solution(&model, &state, &forces);
            let largest = expected.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
            let error = largest_difference(&found, &expected) / largest;
            let label = &candidate.label;
            assert!(error < 170.0 * candidate.epsilon(), "{label}, {solve:?}: {error:e}");
            assert_eq!(found[0], [0.0; 3], "{label}: the held particle");
        }
    }
}

#[test]
fn a_dense_inverse_of_many_particles_is_refused() {
    let cloth =
        grid_cloth("patch", GridPatch::horizontal(65, 0.02, 0.0), material(1e-3, 1.0, 1e-3));
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in
        candidates_with(Feature::DenseInverse).filter(|c| c.precision == Precision::F32)
    {
        let config = SolverConfig::default();
        let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
        let error = kernels.semi_implicit_factorise(LENGTH, SemiImplicitSolve::DenseInverse);
        let error = error.unwrap_err();
        let expected = cloth_core::Error::LimitExceeded {
            limit: "particles of a dense inverse",
            requested: 4225,
            max: 4096,
        };
        assert_eq!(error, expected);
    }
}
