//! Settings, models and states with which an implicit step can do little.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, DivergenceCause, Error, Field, Frame,
    GridPatch, ImplicitSettings, Integrator, LinearSettings, Model, ModelBuilder, ModelError,
    NewtonSettings, Pose, Solver, SolverConfig, State,
};
use harness::{
    backends::{Candidate, candidates_with},
    feature::Feature,
    linear::{LINEAR_METHODS, PRECONDITIONERS},
    models::{grid_cloth, material},
};

use crate::builder;

fn implicit(change: impl FnOnce(&mut ImplicitSettings)) -> Integrator {
    let mut settings = ImplicitSettings::default();
    change(&mut settings);
    Integrator::Implicit(settings)
}

/// The implicit step with every linear solver that a candidate offers.
fn all_solvers(candidate: &Candidate) -> Vec<Integrator> {
    let mut all = Vec::new();
    for &method in LINEAR_METHODS {
        for &preconditioner in PRECONDITIONERS {
            let linear = LinearSettings { method, preconditioner, ..LinearSettings::default() };
            if candidate.offers_linear(&linear) {
                all.push(implicit(|settings| settings.linear = linear));
            }
        }
    }
    all
}

fn solver(
    candidate: &Candidate,
    model: &Arc<Model>,
    time_step: f64,
    integrator: Integrator,
) -> Box<dyn Solver> {
    let config = SolverConfig {
        precision: candidate.precision,
        time_step,
        integrator,
        ..SolverConfig::default()
    };
    candidate.backend.create_solver(model.clone(), &config).unwrap()
}

fn download(solver: &mut dyn Solver) -> State {
    let mut state = State::default();
    solver.download(&mut state).unwrap();
    state
}

#[test]
fn settings_are_checked_by_every_backend() {
    let not_positive = |what: &str| ModelError::NotPositive { what: what.into(), value: 0.0 };
    let out_of_range =
        |what: &str, value| ModelError::OutOfRange { what: what.into(), value, min: 0.0, max: 1.0 };
    let newton = |iterations_max, tolerance| NewtonSettings { iterations_max, tolerance };
    let cases = [
        (
            implicit(|s| s.linear.iterations_max = 0),
            not_positive("iterations of the linear solver"),
        ),
        (
            implicit(|s| s.linear.tolerance = -1e-3),
            out_of_range("tolerance of the linear solver", -1e-3),
        ),
        (
            implicit(|s| s.linear.tolerance = 1.5),
            out_of_range("tolerance of the linear solver", 1.5),
        ),
        (implicit(|s| s.newton = newton(0, 0.1)), not_positive("iterations of Newton's method")),
        (
            implicit(|s| s.newton = newton(3, 2.0)),
            out_of_range("tolerance of Newton's method", 2.0),
        ),
        (implicit(|s| s.constraint_passes = 0), not_positive("passes of the constraints")),
    ];
    let model = Arc::new(builder().build().unwrap());
    for (integrator, expected) in cases {
        for candidate in candidates_with(Feature::Implicit) {
            let config = SolverConfig {
                precision: candidate.precision,
                integrator: integrator.clone(),
                ..SolverConfig::default()
            };
            let error = candidate.backend.create_solver(model.clone(), &config).err();
            assert_eq!(error, Some(Error::Invalid(expected.clone())), "{}", candidate.label);
        }
    }
    let config = SolverConfig {
        integrator: implicit(|s| s.linear.tolerance = f64::NAN),
        ..SolverConfig::default()
    };
    assert!(matches!(config.validate(), Err(ModelError::NonFinite { .. })));
}

/// No equation is left: nothing moves, and that is an answer.
#[test]
fn all_particles_held() {
    let patch = GridPatch::horizontal(4, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    cloth.pins = (0..16).collect();
    let model = Arc::new(ModelBuilder::new().cloth(cloth).build().unwrap());
    for candidate in candidates_with(Feature::Implicit) {
        for integrator in all_solvers(candidate) {
            let mut solver = solver(candidate, &model, 0.01, integrator);
            solver.advance(Frame { duration: 0.05 }).unwrap();
            let report = solver.synchronize().unwrap();
            assert_eq!((report.solver.iterations, report.solver.residual), (0, 0.0));
            let start = candidate.rounded(&model.initial_state());
            assert_eq!(download(&mut *solver).positions, start.positions);
        }
    }
}

/// Steps of a picosecond and of ten seconds, and a cloth almost without stiffness.
#[test]
fn steps_of_any_length_end_in_finite_numbers() {
    for stiffness in [1e-12, 50.0] {
        let patch = GridPatch::horizontal(6, 0.1, 0.0);
        let mut cloth = grid_cloth("patch", patch, material(0.01, stiffness, 1e-3));
        cloth.pins = vec![0, 5];
        let model = Arc::new(ModelBuilder::new().cloth(cloth).build().unwrap());
        for candidate in candidates_with(Feature::Implicit) {
            for integrator in all_solvers(candidate) {
                for time_step in [1e-12, 10.0] {
                    let what = format!("{} {integrator:?} {time_step}", candidate.label);
                    let config = SolverConfig {
                        precision: candidate.precision,
                        time_step,
                        integrator: integrator.clone(),
                        // A cloth that nothing holds together falls a kilometre in ten seconds.
                        strain_bound: 1e12,
                        ..SolverConfig::default()
                    };
                    let mut solver =
                        candidate.backend.create_solver(model.clone(), &config).unwrap();
                    solver.advance(Frame { duration: 5.0 * time_step }).unwrap();
                    if let Err(error) = solver.synchronize() {
                        panic!("{what}: {error}");
                    }
                    let state = download(&mut *solver);
                    assert!(state.validate(&model).is_ok(), "{what}");
                    if time_step < 1.0 {
                        let start = model.initial_state();
                        let moved =
                            state.positions.iter().flatten().zip(start.positions.iter().flatten());
                        let moved = moved.fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
                        assert!(moved < 1e-6, "{what}: moved by {moved}");
                    }
                }
            }
        }
    }
}

fn plane(name: &str, translation: [f64; 3], normal: [f64; 3], friction: f64) -> Collider {
    Collider {
        name: name.into(),
        shape: ColliderShape::Plane,
        pose: Pose::from_z_axis(translation, normal),
        friction,
        restitution: 0.0,
    }
}

/// Two plates that leave the cloth no room: one of them wins, numbers stay finite.
#[test]
fn plates_that_close_on_a_cloth() {
    for friction in [0.0, 0.7] {
        let patch = GridPatch::horizontal(5, 0.05, 0.0);
        let cloth = grid_cloth("patch", patch, material(1e-3, 50.0, 2e-3));
        let model = ModelBuilder::new()
            .cloth(cloth)
            .collider(plane("below", [0.0, 0.0, -0.05], [0.0, 0.0, 1.0], friction))
            .collider(plane("above", [0.0, 0.0, 0.05], [0.0, 0.0, -1.0], friction))
            .build()
            .unwrap();
        let model = Arc::new(model);
        for candidate in candidates_with(Feature::Implicit) {
            for integrator in all_solvers(candidate) {
                let mut solver = solver(candidate, &model, 0.01, integrator);
                for frame in 1..=40 {
                    // They meet after 25 frames and go on through each other.
                    let way = 0.002 * f64::from(frame);
                    let mut control = Control::default();
                    for (collider, sign) in [(0, 1.0), (1, -1.0)] {
                        let mut pose = model.colliders()[collider as usize].pose;
                        pose.translation[2] += sign * way;
                        control.colliders.push(ColliderControl { collider, pose });
                    }
                    solver.set_control(&control).unwrap();
                    solver.advance(Frame { duration: 0.02 }).unwrap();
                    solver.synchronize().unwrap();
                }
                let state = download(&mut *solver);
                // Where they are, and a thickness.
                assert!(
                    state.positions.iter().all(|x| x[2].abs() < 0.05),
                    "{}: squeezed out to {:?}",
                    candidate.label,
                    state.positions[0]
                );
            }
        }
    }
}

/// In the corner of three planes no direction is free.
#[test]
fn a_cloth_in_the_corner_of_three_planes() {
    for friction in [0.0, 0.7] {
        let mut cloth =
            grid_cloth("patch", GridPatch::horizontal(5, 0.05, 0.2), material(1e-3, 50.0, 2e-3));
        cloth.velocity = [-1.0, -1.0, -1.0];
        let pull = Field::Uniform { acceleration: [-9.81, -9.81, 0.0] };
        let model = ModelBuilder::new()
            .cloth(cloth)
            .field(pull)
            .collider(plane("x", [-0.2, 0.0, 0.0], [1.0, 0.0, 0.0], friction))
            .collider(plane("y", [0.0, -0.2, 0.0], [0.0, 1.0, 0.0], friction))
            .collider(plane("z", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], friction))
            .build()
            .unwrap();
        let model = Arc::new(model);
        for candidate in candidates_with(Feature::Implicit) {
            for integrator in all_solvers(candidate) {
                let mut solver = solver(candidate, &model, 1.0 / 60.0, integrator);
                for _ in 0..90 {
                    solver.advance(Frame::per_second(60.0)).unwrap();
                    let measures = solver.synchronize().unwrap().measures;
                    assert!(measures.penetration_max < 1e-6, "{}", candidate.label);
                }
            }
        }
    }
}

/// Velocities that no arithmetic on squares survives: an error with its cause, and the state of the
/// start of the substep.
#[test]
fn velocities_beyond_the_range_diverge_with_a_cause() {
    let model = Arc::new(builder().build().unwrap());
    for candidate in candidates_with(Feature::Implicit) {
        for integrator in all_solvers(candidate) {
            for speed in [1e30, 1e200] {
                let mut state = model.initial_state();
                state.velocities.iter_mut().step_by(2).for_each(|v| v[0] = speed);
                let mut solver = solver(candidate, &model, 0.01, integrator.clone());
                // In single precision 1e200 is no number.
                if solver.upload(&state).is_err() {
                    continue;
                }
                let before = download(&mut *solver);
                solver.advance(Frame { duration: 0.01 }).unwrap();
                let what = format!("{} {speed:e} {integrator:?}", candidate.label);
                match solver.synchronize() {
                    Err(Error::Diverged(divergence)) => {
                        assert_eq!(divergence.step, 1, "{what}");
                        let after = download(&mut *solver);
                        if divergence.cause == DivergenceCause::LinearSolver {
                            assert_eq!(after.positions, before.positions, "{what}");
                        }
                    }
                    other => panic!("{what}: {other:?}"),
                }
            }
        }
    }
}

/// A field so strong that the right-hand side overflows.
#[test]
fn a_right_hand_side_that_is_no_number() {
    let field = Field::Uniform { acceleration: [0.0, 1e300, 0.0] };
    let model = Arc::new(builder().field(field.clone()).field(field).build().unwrap());
    let infinite = Field::Uniform { acceleration: [0.0, 1e308, 0.0] };
    let worse =
        Arc::new((0..40).fold(builder(), |b, _| b.field(infinite.clone())).build().unwrap());
    for candidate in candidates_with(Feature::Implicit) {
        for model in [&model, &worse] {
            for integrator in all_solvers(candidate) {
                let mut solver = solver(candidate, model, 0.01, integrator.clone());
                let before = download(&mut *solver);
                solver.advance(Frame { duration: 0.03 }).unwrap();
                let result = solver.synchronize();
                let what = format!("{} {integrator:?}: {result:?}", candidate.label);
                let Err(Error::Diverged(divergence)) = result else { panic!("{what}") };
                assert!(
                    matches!(
                        divergence.cause,
                        DivergenceCause::LinearSolver
                            | DivergenceCause::NonFinite
                            | DivergenceCause::Strain { .. }
                    ),
                    "{what}"
                );
                if divergence.cause == DivergenceCause::LinearSolver {
                    assert_eq!(divergence.step, 1, "{what}");
                    assert_eq!(download(&mut *solver).positions, before.positions, "{what}");
                }
            }
        }
    }
}
