//! Stiffness, steps and pins at their limits; threads.

use std::sync::Arc;

use cloth_core::{
    Field, Frame, GridPatch, LinearVector, Model, ModelBuilder, Precision, SemiImplicitSolve,
    SolverConfig, State, Stencil, stepper::Substep,
};
use harness::{
    backends::{Candidate, candidates_with, cpu},
    feature::Feature,
    models::{grid_cloth, material},
};

use super::SEMI_IMPLICIT;
use crate::rig::{GRAVITY, advance, build, download, solver_of};

const SIDE: f64 = 0.3;

/// A patch of 16 x 16 particles of a tenth of a gram.
fn patch(stiffness: f64, pins: Vec<u32>) -> Arc<Model> {
    let patch =
        GridPatch { stencil: Stencil::Neighbours24, ..GridPatch::horizontal(16, SIDE / 15.0, 0.0) };
    let mut cloth = grid_cloth("patch", patch, material(1e-4, stiffness, 1e-3));
    cloth.pins = pins;
    build(ModelBuilder::new().field(Field::Drag { rate: [0.5; 3] }).cloth(cloth))
}

/// 10 N/m, and up to 10^6 times that: springs that an explicit step could take with 1 us.
#[test]
fn stiffness_may_be_raised_by_a_million() {
    for candidate in candidates_with(Feature::SemiImplicit) {
        for stiffness in [10.0, 1e3, 1e5, 1e7] {
            let model = patch(stiffness, vec![0, 15]);
            let mut solver = solver_of(candidate, &model, 0.02, SEMI_IMPLICIT);
            let label = &candidate.label;
            for _ in 0..10 {
                let end = advance(&mut *solver, 10, 0.02);
                let report = solver.synchronize().unwrap();
                // What the springs must bear, and twice that while the cloth swings.
                let weight = 256.0 * 1e-4 * GRAVITY;
                let strain = 2.0 * weight / (stiffness * SIDE / 15.0);
                assert!(
                    report.measures.strain_max < strain.max(1e-3),
                    "{label}, {stiffness} N/m: strain {}",
                    report.measures.strain_max
                );
                let speed = (2.0 * GRAVITY * 2.0 * SIDE).sqrt() * (1.0 + strain);
                let fastest = end.velocities.iter().flatten().fold(0.0, |a: f64, b| a.max(b.abs()));
                assert!(fastest < speed, "{label}, {stiffness} N/m: speed {fastest}");
            }
        }
    }
}

/// A stiff cloth that nothing holds falls like a stone: filtering does not touch the mean. Forces of
/// the size k eps L are lost in rounding, against the weight m g: of two or three springs at a particle, in the worst order.
#[test]
fn a_stiff_cloth_falls_like_a_stone() {
    let (mass, stiffness, spacing) = (1e-4, 1e4, 0.02);
    let cloth = grid_cloth(
        "patch",
        GridPatch::horizontal(16, spacing, 0.0),
        material(mass, stiffness, 1e-3),
    );
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates_with(Feature::SemiImplicit) {
        let mut solver = solver_of(candidate, &model, 0.02, SEMI_IMPLICIT);
        let end = advance(&mut *solver, 25, 0.02);
        let tolerance = 2.0 * candidate.epsilon() * stiffness * spacing / (mass * GRAVITY);
        for velocity in &end.velocities {
            let error = (velocity[2] / (-0.5 * GRAVITY) - 1.0).abs();
            assert!(error < tolerance, "{}: {error:e} of {tolerance:e}", candidate.label);
        }
    }
}

#[test]
fn a_cloth_held_everywhere_stays() {
    let model = patch(10.0, (0..256).collect());
    for candidate in candidates_with(Feature::SemiImplicit) {
        let mut solver = solver_of(candidate, &model, 0.02, SEMI_IMPLICIT);
        let start = download(&mut *solver);
        let end = advance(&mut *solver, 5, 0.02);
        assert_eq!(end.positions, start.positions);
        assert_eq!(end.velocities, start.velocities);
    }
}

#[test]
fn the_shortest_and_the_longest_steps_stay_finite() {
    let model = patch(10.0, vec![0]);
    for candidate in candidates_with(Feature::SemiImplicit) {
        for time_step in [1e-12, 1e-6, 1.0, 1e3, 1e6] {
            let mut solver = solver_of(candidate, &model, time_step, SEMI_IMPLICIT);
            let end = advance(&mut *solver, 3, time_step);
            let finite = end.positions.iter().flatten().all(|x| x.is_finite());
            assert!(finite, "{} at {time_step} s", candidate.label);
        }
        // A matrix that overflows is an error, not a state of infinities.
        let mut solver = solver_of(candidate, &model, 1e160, SEMI_IMPLICIT);
        let error = solver.advance(Frame { duration: 1e160 });
        let text = error.unwrap_err().to_string();
        assert!(text.contains("constant matrix"), "{text}");
    }
}

/// Of a cloth that nothing holds, the longest steps leave no trace of the masses in the matrix: it
/// would be singular to rounding if they did not count for more than they are.
#[test]
fn masses_lost_in_the_stiffness_leave_a_matrix_that_can_be_factorised() {
    let model = patch(10.0, Vec::new());
    for candidate in candidates_with(Feature::Factorisation) {
        let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
        let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
        let substep = Substep { length: 1e6, ..Substep::default() };
        let solve = SemiImplicitSolve::Factorisation;
        assert_eq!(kernels.semi_implicit_factorise(substep.length, solve), Ok(true));
        kernels.field_forces().unwrap();
        kernels.spring_forces().unwrap();
        kernels.semi_implicit_solve(&substep).unwrap();
        let mut solution = Vec::new();
        kernels.vector_read(LinearVector::Solution, &mut solution).unwrap();
        // It falls no faster than a stone, then, and all of it alike.
        let fall = -GRAVITY * substep.length;
        for y in &solution {
            assert!(y[2] < 0.0 && y[2] > 1.001 * fall, "{}: {y:?}", candidate.label);
            assert!((y[2] / solution[0][2] - 1.0).abs() < 1e-3, "{}: {y:?}", candidate.label);
        }
    }
}

fn run(threads: usize, precision: Precision) -> State {
    let patch =
        GridPatch { stencil: Stencil::Neighbours24, ..GridPatch::horizontal(90, 0.02, 0.0) };
    let mut cloth = grid_cloth("patch", patch, material(1e-4, 10.0, 1e-3));
    cloth.velocity = [0.3, 0.2, 0.1];
    let free = grid_cloth(
        "free",
        GridPatch { origin: [3.0, 0.0, 0.0], ..GridPatch::horizontal(40, 0.02, 0.0) },
        material(1e-4, 10.0, 1e-3),
    );
    cloth.pins = vec![0, 89];
    let model = build(ModelBuilder::new().cloth(cloth).cloth(free));
    let candidate = Candidate::new("cpu", Box::new(cpu(threads)), precision);
    let config = SolverConfig {
        precision,
        time_step: 0.01,
        integrator: SEMI_IMPLICIT,
        ..SolverConfig::default()
    };
    let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
    let mut state = model.initial_state();
    for (i, x) in state.positions.iter_mut().enumerate().filter(|(i, _)| i % 3 == 0) {
        x[2] += 1e-3 * (i % 7) as f64;
    }
    solver.upload(&state).unwrap();
    solver.advance(Frame { duration: 0.045 }).unwrap();
    solver.synchronize().unwrap();
    download(&mut *solver)
}

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    for precision in [Precision::F32, Precision::F64] {
        let expected = run(1, precision);
        assert_eq!(run(2, precision), expected);
        assert_eq!(run(8, precision), expected);
    }
}
