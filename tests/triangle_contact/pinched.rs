//! Bodies that go into each other with cloth between: it is left inside of them, and is outside of both and in one piece once they have parted.

use std::sync::Arc;

use cloth::SceneAudit;
use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, Error, Frame, Integrator, Model,
    ModelBuilder, Pinch, Pose, Result, Solver, SolverConfig, State,
};
use harness::{backends::Candidate, bits::first_difference};

use crate::{
    bits::pairs,
    rig::{contact, integrators, others, processor, sheet},
};

const SIDE: u32 = 9;
const FRAMES: u32 = 24;
/// The frame in which the bodies are furthest inside of each other.
const DEEPEST: u32 = 8;

/// A sheet that is held at its corners between two boxes.
fn model() -> Arc<Model> {
    let body = |name: &str, height: f64| Collider {
        name: name.into(),
        shape: ColliderShape::Box { half_extents: [0.031, 0.029, 0.02] },
        pose: Pose::from_translation([0.0, 0.0, height]),
        friction: 0.3,
        restitution: 0.0,
    };
    let mut cloth = sheet("sheet", SIDE, 0.0153, [0.003, 0.002, 0.0], 0.1);
    cloth.pins = vec![0, SIDE - 1, SIDE * (SIDE - 1), SIDE * SIDE - 1];
    let builder = ModelBuilder::new()
        .self_contact(contact(2e-3, 0.3))
        .cloth(cloth)
        .collider(body("anvil", -0.03))
        .collider(body("hammer", 0.03));
    Arc::new(builder.build().expect("it is valid"))
}

/// Where the bodies are at the end of a frame: 6 mm inside of each other at the deepest.
fn control(frame: u32) -> Control {
    let closed = 1.0 - f64::from(frame.abs_diff(DEEPEST)).min(8.0) / 8.0;
    let pose = |height: f64| Pose::from_translation([0.0, 0.0, height]);
    let colliders = vec![
        ColliderControl { collider: 0, pose: pose(-0.03 + 0.013 * closed) },
        ColliderControl { collider: 1, pose: pose(0.03 - 0.013 * closed) },
    ];
    Control { colliders, ..Control::default() }
}

fn solver(
    candidate: &Candidate,
    model: &Arc<Model>,
    (integrator, time_step): (Integrator, f64),
    pinch: Pinch,
) -> Box<dyn Solver> {
    let precision = candidate.precision;
    let config =
        SolverConfig { integrator, time_step, precision, pinch, ..SolverConfig::default() };
    candidate.backend.create_solver(Arc::clone(model), &config).expect("it has contact with bodies")
}

/// One frame: how many particles are left inside of bodies.
fn step(solver: &mut dyn Solver, frame: u32) -> Result<u64> {
    solver.set_control(&control(frame))?;
    solver.advance(Frame::per_second(60.0))?;
    Ok(solver.synchronize()?.contact_ghosts)
}

fn state(solver: &mut dyn Solver) -> State {
    let mut state = State::default();
    solver.download(&mut state).expect("the state can be read");
    state
}

/// All frames: ghosts in each of them, and the last state.
fn run(candidate: &Candidate, model: &Arc<Model>, way: (Integrator, f64)) -> (Vec<u64>, State) {
    let mut solver = solver(candidate, model, way, Pinch::Ghost);
    let ghosts = (1..=FRAMES).map(|frame| step(&mut *solver, frame).expect("it goes on")).collect();
    (ghosts, state(&mut *solver))
}

#[test]
fn what_bodies_pinch_comes_out_again() {
    let model = model();
    let audit = SceneAudit::new(&model);
    for candidate in others().chain([processor()]) {
        let _turn = candidate.turn();
        for way in integrators(&model) {
            let what = format!("{} {:?}", candidate.label, way.0);
            let (ghosts, state) = run(candidate, &model, way);
            assert!(ghosts[DEEPEST as usize - 1] > 8, "{what}: {ghosts:?}");
            assert_eq!((ghosts[0], ghosts[FRAMES as usize - 1]), (0, 0), "{what}: {ghosts:?}");
            assert!(state.ghosts.is_empty(), "{what}");
            assert_eq!(state.held.iter().filter(|held| **held != 0).count(), 4, "{what}");
            let end = f64::from(FRAMES) / 60.0;
            let found = audit.at(&state.positions, &state.colliders, end);
            assert_eq!(found.pairs(), 0, "{what}: {found:?}");
            let middle = state.positions[(SIDE * SIDE / 2) as usize];
            assert!(middle[2].abs() < 0.01, "{what}: {middle:?}");
        }
    }
}

#[test]
fn cuda_pinches_with_the_bits_of_the_cpu() {
    let model = model();
    for [cuda, cpu] in pairs() {
        for way in &integrators(&model)[..2] {
            let what = format!("{} {:?}", cuda.label, way.0);
            let [expected, found] = [cpu, cuda].map(|one| run(one, &model, way.clone()));
            assert_eq!(expected.0, found.0, "{what}");
            assert_eq!(first_difference(&expected.1, &found.1), None, "{what}");
        }
    }
}

/// Without ghosts the run ends; a state goes on with those that it has, to the last bit.
#[test]
fn a_state_knows_what_is_pinched() {
    let (model, processor) = (model(), processor());
    let [way, ..] = integrators(&model);
    let mut refused = solver(processor, &model, way.clone(), Pinch::Refuse);
    let error = (1..=DEEPEST).find_map(|frame| step(&mut *refused, frame).err());
    assert!(matches!(error, Some(Error::PinchedByBody { .. })), "{error:?}");
    let mut first = solver(processor, &model, way.clone(), Pinch::Ghost);
    for frame in 1..=DEEPEST {
        step(&mut *first, frame).expect("it goes on");
    }
    let middle = state(&mut *first);
    assert!(!middle.ghosts.is_empty());
    let mut second = solver(processor, &model, way, Pinch::Ghost);
    second.upload(&middle).expect("it fits");
    for frame in DEEPEST + 1..=FRAMES {
        let ghosts = [&mut first, &mut second].map(|solver| step(&mut **solver, frame).ok());
        assert_eq!(ghosts[0], ghosts[1], "frame {frame}");
    }
    let [first, second] = [&mut first, &mut second].map(|solver| state(&mut **solver));
    assert_eq!(first_difference(&first, &second), None);
    let mut wrong = middle;
    wrong.ghosts[0].particle = 9999;
    let error = wrong.validate(&model).expect_err("there is no such particle");
    assert!(error.to_string().contains("9999"), "{error}");
}
