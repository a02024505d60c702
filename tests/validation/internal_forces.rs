//! Laws that internal forces obey whatever the springs are.

use cloth_core::{GridPatch, ModelBuilder, SolverConfig, State};
use glam::{DQuat, DVec3};
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
    random::Random,
    stages::{Particles, spring_forces},
    tracked::TrackedVector,
};

use crate::rig::{advance, build, in_double, solver};

/// A patch with damped springs, jittered in position and velocity.
fn jittered() -> (std::sync::Arc<cloth_core::Model>, State) {
    let mut fabric = material(0.01, 50.0, 1e-3);
    fabric.stretch.damping = 0.02;
    let patch = GridPatch::horizontal(9, 0.1, 0.0);
    let model =
        build(ModelBuilder::new().gravity([0.0; 3]).cloth(grid_cloth("patch", patch, fabric)));
    let mut random = Random::new(3);
    let mut state = model.initial_state();
    for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
        let [dx, dv] = [random.vector(0.03), random.vector(1.0)];
        *x = std::array::from_fn(|k| x[k] + dx[k]);
        *v = dv;
    }
    (model, state)
}

/// Newton's third law: internal forces add up to no force and no torque, but for the rounding of
/// each.
#[test]
fn internal_forces_have_no_sum_and_no_torque() {
    let (model, state) = jittered();
    for candidate in candidates() {
        let state = candidate.rounded(&state);
        let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
        let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
        kernels.state_write(&state).unwrap();
        kernels.field_forces().unwrap();
        kernels.spring_forces().unwrap();
        let mut forces = Vec::new();
        kernels.forces_read(&mut forces).unwrap();
        let mut bounds = vec![TrackedVector::ZERO; forces.len()];
        let particles = Particles::new(&model, &state, candidate.epsilon());
        spring_forces(&model, &particles, &mut bounds);
        let [mut force, mut torque] = [DVec3::ZERO; 2];
        let [mut force_bound, mut torque_bound] = [0.0; 2];
        for ((f, bound), &x) in forces.iter().zip(&bounds).zip(&state.positions) {
            let [f, x] = [DVec3::from(*f), DVec3::from(x)];
            let rounding: f64 =
                bound.0.iter().map(|&component| candidate.tolerance(component)).sum();
            force += f;
            torque += x.cross(f);
            force_bound += rounding;
            torque_bound += rounding * x.length();
        }
        assert!(force.length() <= force_bound, "{}: force {force}", candidate.label);
        assert!(torque.length() <= torque_bound, "{}: torque {torque}", candidate.label);
    }
}

/// Springs do not see how the world is oriented: a rotated and shifted start gives the rotated and
/// shifted end.
#[test]
fn rigid_motion_of_the_start_is_rigid_motion_of_the_end() {
    let (model, state) = jittered();
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.1);
    let shift = DVec3::new(0.3, -0.2, 0.5);
    let moved = |state: &State| {
        let mut state = state.clone();
        for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
            *x = (turn * DVec3::from(*x) + shift).into();
            *v = (turn * DVec3::from(*v)).into();
        }
        state
    };
    let run = |candidate, start: &State| {
        let mut solver = solver(candidate, &model, 1e-3);
        solver.upload(start).unwrap();
        advance(&mut *solver, 100, 1e-3)
    };
    for candidate in in_double() {
        let [straight, turned] = [run(candidate, &state), run(candidate, &moved(&state))];
        for (expected, found) in moved(&straight).positions.iter().zip(&turned.positions) {
            let error = DVec3::from(*expected).distance(DVec3::from(*found));
            // A tenth of a second is 9 times the shortest time scale sqrt(m/12 k): rounding errors
            // grow by less than e^9.
            assert!(error < 8103.0 * candidate.epsilon(), "{}: {error:e}", candidate.label);
        }
    }
}
