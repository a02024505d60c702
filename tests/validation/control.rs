//! Particles held, moved and released.

use cloth_core::{Control, GridPatch, ModelBuilder, PinAction, PinControl, State};
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
};

use crate::rig::{GRAVITY, advance, build, integrators, particles, solver_of};

fn pin(particle: u32, action: PinAction) -> Control {
    Control { pins: vec![PinControl { particle, action }], ..Control::default() }
}

/// A moved pin arrives at the last bit of the precision, and stays.
#[test]
fn a_moved_pin_arrives_exactly() {
    let time_step = 1e-3;
    let patch = GridPatch::horizontal(4, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    cloth.pins = vec![0, 3];
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let target = [0.123_456_789, -0.2, 0.377];
            solver.set_control(&pin(3, PinAction::MoveTo(target))).unwrap();
            let state = advance(&mut *solver, 7, time_step);
            let expected = State { positions: vec![target], ..State::default() };
            let expected = candidate.rounded(&expected).positions[0];
            assert_eq!(state.positions[3], expected, "{}", candidate.label);
            let later = advance(&mut *solver, 7, time_step);
            assert_eq!(later.positions[3], expected, "{}: moved on", candidate.label);
            assert_eq!(later.positions[0], candidate.rounded(&model.initial_state()).positions[0]);
            assert_eq!(later.held[3], 1);
        }
    }
}

/// What is held in flight goes from where it is.
#[test]
fn a_particle_that_is_moved_by_a_way_goes_from_where_it_is() {
    let time_step = 1e-3;
    let patch = GridPatch::horizontal(4, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    cloth.pins = vec![0];
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let fallen = advance(&mut *solver, 20, time_step).positions[15];
            assert!(fallen[2] < model.positions()[15][2], "{}: {fallen:?}", candidate.label);
            let way = [0.02, 0.0, 0.01];
            for times in [1.0, 2.0] {
                solver.set_control(&pin(15, PinAction::MoveBy(way))).unwrap();
                let state = advance(&mut *solver, 10, time_step);
                for axis in 0..3 {
                    let expected = fallen[axis] + times * way[axis];
                    let found = state.positions[15][axis];
                    assert!((found - expected).abs() < 1e-6, "{}: {found}", candidate.label);
                }
                assert_eq!(state.held[15], 1);
            }
        }
    }
}

/// A solver remembers where held particles are as the state has it: one that is given its own state again goes on with the same
/// bits.
#[test]
fn places_of_pins_are_remembered_as_the_state_has_them() {
    let time_step = 1e-3;
    let mut cloth =
        grid_cloth("patch", GridPatch::horizontal(4, 0.1, 0.0), material(0.01, 50.0, 1e-3));
    cloth.pins = vec![0, 3];
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let states = [false, true].map(|is_given_again| {
                let mut solver = solver_of(candidate, &model, time_step, integrator.clone());
                let mut state = model.initial_state();
                for frame in 1..4 {
                    let target = [0.1 / 3.0 * f64::from(frame), -0.1, 0.377 / f64::from(frame)];
                    solver.set_control(&pin(3, PinAction::MoveTo(target))).unwrap();
                    state = advance(&mut *solver, 3, time_step);
                    if is_given_again {
                        solver.upload(&state).unwrap();
                    }
                }
                state
            });
            assert_eq!(states[0].positions, states[1].positions, "{}", candidate.label);
            assert_eq!(states[0].velocities, states[1].velocities, "{}", candidate.label);
        }
    }
}

/// The cloth follows what holds it, during the frame and not after it.
#[test]
fn moved_pins_pull_their_neighbours_along() {
    let time_step = 1e-3;
    let patch = GridPatch::horizontal(2, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    cloth.pins = vec![0, 1];
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let up = |particle: u32| {
                let x = model.positions()[particle as usize];
                PinControl { particle, action: PinAction::MoveTo([x[0], x[1], x[2] + 0.05]) }
            };
            solver
                .set_control(&Control { pins: vec![up(0), up(1)], ..Control::default() })
                .unwrap();
            let state = advance(&mut *solver, 50, time_step);
            for follower in [2, 3] {
                assert!(state.positions[follower][2] > 0.0, "{}: left behind", candidate.label);
            }
        }
    }
}

/// A held particle hangs in the air; from its release on it falls as any other.
#[test]
fn a_released_pin_falls() {
    let time_step = 1e-3;
    let mut cloth = particles(&[[0.0; 3], [1.0, 0.0, 0.0]], [0.0; 3]);
    cloth.pins = vec![0, 1];
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let held = advance(&mut *solver, 100, time_step);
            assert_eq!(held.positions, model.positions(), "{}", candidate.label);
            solver.set_control(&pin(1, PinAction::Release)).unwrap();
            let steps = 200;
            let state = advance(&mut *solver, steps, time_step);
            let n = f64::from(steps);
            let fall = GRAVITY * time_step * time_step * n * (n + 1.0) / 2.0;
            assert_eq!(state.positions[0], [0.0; 3]);
            // n roundings of a velocity of up to g n h, each of which counts for n steps of h.
            let tolerance = 2.0 * n * n * time_step * candidate.epsilon() * GRAVITY * n * time_step;
            assert!((state.positions[1][2] + fall).abs() <= tolerance, "{}", candidate.label);
            solver.set_control(&pin(1, PinAction::Hold)).unwrap();
            let caught = advance(&mut *solver, 100, time_step);
            assert_eq!(caught.positions[1], state.positions[1], "{}: not held", candidate.label);
        }
    }
}
