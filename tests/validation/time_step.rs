//! The adaptive time step: what goes wrong is done again with shorter substeps, and no more than that.

use std::sync::Arc;

use cloth_core::{
    AdaptiveSettings, Control, DivergenceCause, Error, Frame, GridPatch, ImplicitSettings,
    Integrator, LinearSettings, Model, ModelBuilder, PinAction, PinControl, Solver, SolverConfig,
    State, StepReport, TimeStepChange, TimeStepControl, TimeStepReason,
};
use harness::{
    backends::{Candidate, candidates},
    bits::first_difference,
    models::{grid_cloth, material},
};

use crate::{
    oscillator::{AMPLITUDE, MASS, REST_LENGTH, STIFFNESS, angular_frequency, oscillator},
    rig::{GRAVITY, build, chain, download, particles},
};

const SPACING: f64 = 0.05;

/// A patch that hangs from two corners, beside a particle that falls freely.
fn hanging() -> Arc<Model> {
    let mut fabric = material(1e-3, 40.0, 1e-3);
    for springs in [&mut fabric.stretch, &mut fabric.shear, &mut fabric.bend] {
        springs.damping = 0.02;
    }
    let mut cloth = grid_cloth("patch", GridPatch::horizontal(6, SPACING, 0.0), fabric);
    cloth.pins = vec![0, 5];
    build(ModelBuilder::new().cloth(cloth).cloth(particles(&[[9.0, 0.0, 0.0]], [0.0; 3])))
}

/// The particle that falls.
const FALLING: usize = 36;

fn adaptive(halvings_max: u32) -> TimeStepControl {
    TimeStepControl::Adaptive(AdaptiveSettings {
        strain_max: 0.3,
        halvings_max,
        ..AdaptiveSettings::default()
    })
}

fn solver(
    candidate: &Candidate,
    model: &Arc<Model>,
    time_step: f64,
    time_step_control: TimeStepControl,
) -> Box<dyn Solver> {
    let config = SolverConfig {
        precision: candidate.precision,
        time_step,
        time_step_control,
        ..SolverConfig::default()
    };
    candidate.backend.create_solver(model.clone(), &config).unwrap()
}

fn frame(solver: &mut dyn Solver, duration: f64) -> cloth_core::Result<StepReport> {
    solver.advance(Frame { duration })?;
    solver.synchronize()
}

/// Each decision goes on from the one before and in the direction of its reason. Returns the length
/// after the last one.
fn decisions_follow(changes: &[TimeStepChange], mut length: f64) -> f64 {
    let mut time = f64::NEG_INFINITY;
    for change in changes {
        assert_eq!(change.from, length);
        // Sums of other lengths may differ in their last digits.
        assert!(change.time >= time - 1e-12);
        let grows = change.reason == TimeStepReason::Recovered;
        let expected = if grows { 2.0 * change.from } else { 0.5 * change.from };
        assert_eq!(change.to, expected, "{change:?}");
        (length, time) = (change.to, change.time);
    }
    length
}

#[test]
fn an_unstable_time_step_is_halved_until_it_is_stable() {
    let model = hanging();
    let time_step = 3.0 * model.stable_time_step_at_rest();
    let duration = 4.0 * time_step;
    for candidate in candidates() {
        let mut fixed = solver(candidate, &model, time_step, TimeStepControl::Fixed);
        let error = (0..60).find_map(|_| frame(&mut *fixed, duration).err());
        assert!(matches!(error, Some(Error::Diverged(_))), "{}: {error:?}", candidate.label);

        // Once halved, it stays so: grown back, it would become unstable again.
        let control = TimeStepControl::Adaptive(AdaptiveSettings {
            strain_max: 0.3,
            grow_after: 100_000,
            ..AdaptiveSettings::default()
        });
        let mut solver = solver(candidate, &model, time_step, control);
        let mut length = time_step;
        for number in 1..=60 {
            let report = frame(&mut *solver, duration).unwrap();
            let changes = &report.solver.time_step_changes;
            length = decisions_follow(changes, length);
            for change in changes {
                let TimeStepReason::Strain { strain } = change.reason else {
                    panic!("{}: {change:?}", candidate.label);
                };
                assert!(strain > 0.3);
            }
            if number > 30 {
                assert!(report.measures.strain_max <= 0.3, "{}: frame {number}", candidate.label);
                assert_eq!((changes.len(), report.solver.substeps_failed), (0, 0));
                assert_eq!(f64::from(report.substeps), duration / length, "frame {number}");
            }
        }
        assert!(length < model.stable_time_step_at_rest(), "{}: {length}", candidate.label);
        // What falls freely has the velocity g t, however the time is divided.
        let state = download(&mut *solver);
        let expected = -GRAVITY * 60.0 * duration;
        let error = (state.velocities[FALLING][2] / expected - 1.0).abs();
        assert!(error < 5e3 * candidate.epsilon(), "{}: {error:e}", candidate.label);
        assert!((state.time - 60.0 * duration).abs() < 1e-9 * state.time);
    }
}

/// Two masses fly apart so fast that the first long substep stretches the spring too far; as damping
/// slows them down, long substeps are good enough again.
#[test]
fn the_time_step_grows_back_after_a_disturbance() {
    let time_step = 1.4 / angular_frequency();
    let mut cloth = chain(vec![[0.0; 3], [REST_LENGTH, 0.0, 0.0]], &[REST_LENGTH], MASS, STIFFNESS);
    // A twenty-fifth of the critical damping.
    let springs = cloth.material.springs_mut().expect("the rig is made of springs");
    springs.stretch.damping = 0.02 * MASS * angular_frequency();
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
    let speed = 0.25 * REST_LENGTH * angular_frequency();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step, adaptive(6));
        let mut start = model.initial_state();
        start.velocities = vec![[-0.5 * speed, 0.0, 0.0], [0.5 * speed, 0.0, 0.0]];
        solver.upload(&start).unwrap();
        let mut length = time_step;
        let mut shortest = time_step;
        for _ in 0..20 {
            let report = frame(&mut *solver, 4.0 * time_step).unwrap();
            for change in &report.solver.time_step_changes {
                shortest = shortest.min(change.to);
            }
            length = decisions_follow(&report.solver.time_step_changes, length);
        }
        assert!(shortest <= 0.5 * time_step, "{}: never halved", candidate.label);
        assert_eq!(length, time_step, "{}: not grown back", candidate.label);
        let report = frame(&mut *solver, 4.0 * time_step).unwrap();
        assert_eq!((report.substeps, report.solver.time_step_changes.len()), (4, 0));
        let state = download(&mut *solver);
        assert_eq!((state.time_step_halvings, state.time_step_good), (0, 0));
    }
}

#[test]
fn a_resumed_run_goes_on_with_the_same_bits_and_the_same_length() {
    let model = hanging();
    let time_step = 3.0 * model.stable_time_step_at_rest();
    let duration = 1.5 * time_step;
    for candidate in candidates() {
        let new = || solver(candidate, &model, time_step, adaptive(6));
        let mut whole = new();
        let mut states: Vec<State> = Vec::new();
        for _ in 0..40 {
            frame(&mut *whole, duration).unwrap();
            states.push(download(&mut *whole));
        }
        let wanted = &states[39];
        let halfway = |state: &&State| state.time_step_halvings > 0 && state.time_step_good > 0;
        let from = states[10..30].iter().position(|state| halfway(&state));
        let from = 10 + from.expect("some frame ends between two changes");
        let mut resumed = new();
        resumed.upload(&states[from]).unwrap();
        for _ in from + 1..40 {
            frame(&mut *resumed, duration).unwrap();
        }
        let found = download(&mut *resumed);
        assert_eq!(first_difference(&found, wanted), None, "{}", candidate.label);
        assert_eq!(&found, wanted);
        // The length matters: without it the run is another one.
        let mut forgetful = new();
        let state = State { time_step_halvings: 0, time_step_good: 0, ..states[from].clone() };
        forgetful.upload(&state).unwrap();
        for _ in from + 1..40 {
            frame(&mut *forgetful, duration).unwrap();
        }
        assert_ne!(first_difference(&download(&mut *forgetful), wanted), None);
    }
}

#[test]
fn halvings_have_their_limit_and_what_fails_then_stands() {
    let model = oscillator();
    let time_step = 4.4 / angular_frequency();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step, adaptive(1));
        let mut failed = 0;
        let error = (0..100).find_map(|_| match frame(&mut *solver, time_step) {
            Ok(report) => {
                let shortest =
                    report.solver.time_step_changes.iter().all(|c| c.to >= 0.5 * time_step);
                assert!(shortest, "{}: {report:?}", candidate.label);
                failed += report.solver.substeps_failed;
                None
            }
            Err(error) => Some(error),
        });
        let Some(Error::Diverged(divergence)) = error else {
            panic!("{}: {error:?} instead of a divergence", candidate.label);
        };
        assert!(matches!(divergence.cause, DivergenceCause::Strain { .. }), "{divergence}");
        assert_eq!(divergence.time_step, 0.5 * time_step, "{}", candidate.label);
        assert!(failed > 0, "{}: nothing stands that failed", candidate.label);
    }
}

/// No length is short enough for numbers that overflow: the last attempt is the divergence.
#[test]
fn an_overflow_at_the_shortest_length_is_a_divergence() {
    let model = oscillator();
    let time_step = 1e200 / angular_frequency();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step, adaptive(2));
        let error = frame(&mut *solver, time_step).err();
        let Some(Error::Diverged(divergence)) = error else {
            panic!("{}: {error:?} instead of a divergence", candidate.label);
        };
        assert_eq!(divergence.cause, DivergenceCause::NonFinite, "{}", candidate.label);
        assert_eq!(divergence.time_step, 0.25 * time_step);
        assert_eq!(divergence.step, 1);
    }
}

#[test]
fn without_halvings_the_bits_are_those_of_a_fixed_time_step() {
    let model = hanging();
    let time_step = 0.5 * model.stable_time_step_at_rest();
    for candidate in candidates() {
        let states = [TimeStepControl::Fixed, adaptive(0)].map(|control| {
            let mut solver = solver(candidate, &model, time_step, control);
            for _ in 0..20 {
                frame(&mut *solver, 7.3 * time_step).unwrap();
            }
            download(&mut *solver)
        });
        assert_eq!(states[0], states[1], "{}", candidate.label);
        assert!(states[0].velocities[20][2] != 0.0, "nothing moves");
    }
}

/// Pins go on at their constant velocity, and arrive exactly, when the frame is divided again.
#[test]
fn a_moved_pin_arrives_exactly_in_a_frame_that_is_divided_again() {
    let model = hanging();
    let time_step = 3.0 * model.stable_time_step_at_rest();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step, adaptive(6));
        let mut divided = 0;
        for number in 1..=40 {
            let target = [0.125, -0.125 + 1e-3 * f64::from(number), 1e-3 * f64::from(number)];
            let pin = PinControl { particle: 5, action: PinAction::MoveTo(target) };
            solver.set_control(&Control { pins: vec![pin], ..Control::default() }).unwrap();
            let report = frame(&mut *solver, 2.0 * time_step).unwrap();
            divided += report.solver.time_step_changes.len();
            let expected = State { positions: vec![target], ..State::default() };
            let expected = candidate.rounded(&expected).positions[0];
            let state = download(&mut *solver);
            assert_eq!(state.positions[5], expected, "{}", candidate.label);
        }
        assert!(divided > 0, "{}: no frame was divided again", candidate.label);
    }
}

/// A substep at rest with the amplitude of the oscillator is good at any length that is stable.
#[test]
fn a_good_run_is_left_alone() {
    let model = oscillator();
    let time_step = 0.5 / angular_frequency();
    const { assert!(AMPLITUDE < 0.3 * REST_LENGTH) };
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step, adaptive(6));
        for _ in 0..20 {
            let report = frame(&mut *solver, 5.0 * time_step).unwrap();
            assert_eq!(report.substeps, 5);
            assert_eq!(report.solver.time_step_changes, []);
        }
    }
}

/// The cap on iterations is met by shorter substeps: their systems are closer to the masses alone. A
/// tolerance of zero asks for the cap, not for a residual.
#[test]
fn a_linear_solve_that_misses_its_tolerance_is_done_in_shorter_substeps() {
    let model = hanging();
    let time_step = 1.0 / 30.0;
    for candidate in candidates() {
        let run = |tolerance: f64| {
            let linear =
                LinearSettings { tolerance, iterations_max: 6, ..LinearSettings::default() };
            let config = SolverConfig {
                precision: candidate.precision,
                time_step,
                time_step_control: TimeStepControl::Adaptive(AdaptiveSettings::default()),
                integrator: Integrator::Implicit(ImplicitSettings {
                    linear,
                    ..ImplicitSettings::default()
                }),
                ..SolverConfig::default()
            };
            let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
            let frames = (0..20).map(|_| frame(&mut *solver, time_step).unwrap().solver);
            frames.collect::<Vec<_>>()
        };
        let tolerance = 1e-2;
        let reports = run(tolerance);
        let mut length = time_step;
        for report in &reports {
            length = decisions_follow(&report.time_step_changes, length);
            for change in report.time_step_changes.iter().filter(|c| c.to < c.from) {
                let TimeStepReason::LinearSolver { residual } = change.reason else {
                    panic!("{}: {change:?}", candidate.label);
                };
                assert!(residual > tolerance);
            }
            assert_eq!((report.substeps_failed, report.solves_unconverged), (0, 0));
            assert!(report.residual <= tolerance, "of the substeps that stand");
        }
        let taken_back = reports.iter().flat_map(|report| &report.time_step_changes);
        assert!(taken_back.count() > 0, "{}: nothing was taken back", candidate.label);
        for report in run(0.0) {
            assert_eq!(report.time_step_changes, []);
            assert!(report.solves_unconverged > 0);
        }
    }
}
