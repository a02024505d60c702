//! Candidate lists that do not fit or are used too long: frames are done again, nothing is lost.

use std::sync::Arc;

use cloth_core::{
    Backend, ContactResponse, Control, Field, Frame, GridPatch, ModelBuilder, PinAction,
    PinControl, Precision, SelfContact, SolverConfig, State,
};
use harness::{
    backends::{cpu, gpu},
    bits::first_difference,
    models::{grid_cloth, material},
};

/// Particles of a sheet that makes the others one model of many groups, which is searched in another form than those of
/// up to 1024 groups of 32 particles.
const FAR_SIDE: u32 = 186;

/// Sheets so close to each other that every particle is in contact with hundreds, and others that touch nothing.
fn pile(others: &[u32]) -> Arc<cloth_core::Model> {
    let spacing = 0.02;
    let mut builder = ModelBuilder::new().self_contact(SelfContact {
        distance: 3.9 * spacing,
        response: ContactResponse::Penalty { stiffness: 0.01, damping: 0.0 },
    });
    let layers = (0..6).map(|layer| (16, spacing, 0.001 * f64::from(layer)));
    let others = others.iter().map(|&side| (side, 4.0 * spacing, 30.0));
    for (number, (side, spacing, height)) in layers.chain(others).enumerate() {
        let patch = GridPatch::horizontal(side, spacing, height);
        let name = number.to_string();
        builder = builder.cloth(grid_cloth(&name, patch, material(1e-4, 10.0, 1e-3)));
    }
    Arc::new(builder.build().unwrap())
}

#[test]
fn full_rows_grow_and_the_frame_is_done_again() {
    full_rows_grow(&[]);
}

#[test]
fn full_rows_grow_in_a_model_of_many_groups_too() {
    full_rows_grow(&[FAR_SIDE]);
}

fn full_rows_grow(others: &[u32]) {
    let model = pile(others);
    let config = SolverConfig { strain_bound: 1e3, ..SolverConfig::default() };
    let mut solver = gpu().create_solver(Arc::clone(&model), &config).unwrap();
    solver.advance(Frame { duration: 2e-3 }).unwrap();
    let report = solver.synchronize().unwrap();
    // Far above the sixteen partners for each particle, and the 32 groups for each of 48, that there is room for at
    // first.
    assert!(report.contacts > 50 * 6 * 16 * 16);
    assert!(report.contact_candidates > 33 * 48 * 32 * 32);
    let mut found = State::default();
    solver.download(&mut found).unwrap();

    let reference = SolverConfig { precision: Precision::F64, ..config };
    let mut solver = cpu(2).create_solver(model, &reference).unwrap();
    solver.advance(Frame { duration: 2e-3 }).unwrap();
    assert_eq!(report.contacts, solver.synchronize().unwrap().contacts);
    let mut expected = State::default();
    solver.download(&mut expected).unwrap();
    for (found, expected) in found.velocities.iter().zip(&expected.velocities).take(6 * 16 * 16) {
        for (found, expected) in found.iter().zip(expected) {
            // Two substeps at 1e-4 kg: forces of up to 0.1 N give velocities of about 1 m/s.
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }
}

/// Length of a substep of the sheet that is torn \[s\].
const TORN_STEP: f64 = 2.5e-4;

/// What it falls in the first substep \[m\], twice that in the second one and so on.
const TORN_FALL: f64 = 0.0125;

/// A sheet that is torn through one that is held, so fast that it touches it in a single substep, number `substeps`. It rests when the
/// list is first built, far away, and has left its region long before there is an opportunity to build the list again.
fn torn(substeps: u32) -> Arc<cloth_core::Model> {
    let spacing = 0.02;
    let response = ContactResponse::Penalty { stiffness: 50.0, damping: 0.0 };
    let sheet = |name, height| {
        let patch = GridPatch::horizontal(12, spacing, height);
        grid_cloth(name, patch, material(1e-3, 10.0, 1e-3))
    };
    let mut held = sheet("held", 0.0);
    held.pins = (0..144).collect();
    let fallen = 0.5 * TORN_FALL * f64::from(substeps * (substeps - 1));
    let acceleration = [0.0, 0.0, -TORN_FALL / (TORN_STEP * TORN_STEP)];
    let model = ModelBuilder::new()
        .cloth(held)
        .cloth(sheet("torn", fallen + 0.3 * spacing))
        .field(Field::Uniform { acceleration })
        .self_contact(SelfContact { distance: 0.8 * spacing, response })
        .build()
        .unwrap();
    Arc::new(model)
}

/// Its state after so many substeps, in frames that follow each other before anybody asks.
fn torn_state(backend: &dyn Backend, precision: Precision, substeps: u32, frames: u32) -> State {
    let config = SolverConfig {
        precision,
        time_step: TORN_STEP,
        strain_bound: 1e3,
        ..SolverConfig::default()
    };
    let mut solver = backend.create_solver(torn(substeps), &config).unwrap();
    let duration = f64::from(substeps) * TORN_STEP / f64::from(frames);
    for _ in 0..frames {
        solver.advance(Frame { duration }).unwrap();
    }
    solver.synchronize().unwrap();
    let mut state = State::default();
    solver.download(&mut state).unwrap();
    state
}

/// What contact has added to its velocities, all together \[m/s\].
fn torn_change(state: &State, substeps: u32) -> f64 {
    let fallen = -f64::from(substeps) * (TORN_FALL / TORN_STEP + 9.81 * TORN_STEP);
    state.velocities[144..].iter().map(|v| v[2] - fallen).sum()
}

#[test]
fn a_list_that_is_used_too_long_is_built_more_often() {
    let expected = torn_change(&torn_state(&cpu(2), Precision::F64, 8, 1), 8);
    assert!(expected > 10.0, "the sheets touched: {expected}");
    let states = [1, 4].map(|frames| torn_state(gpu(), Precision::F32, 8, frames));
    let found = torn_change(&states[0], 8);
    assert!((found - expected).abs() < 1e-2, "{found} {expected}");
    // Frames that follow each other before anybody asks are done again together.
    assert_eq!(first_difference(&states[0], &states[1]), None);
}

/// The sheet is held for a while: it is known by then that the first frames were good.
#[test]
fn frames_are_done_again_without_those_that_are_known_to_be_good() {
    let [quiet, substeps] = [20, 20];
    let frame = Frame { duration: TORN_STEP };
    let config =
        SolverConfig { time_step: TORN_STEP, strain_bound: 1e3, ..SolverConfig::default() };
    let states = [false, true].map(|asks| {
        let mut solver = gpu().create_solver(torn(substeps), &config).unwrap();
        for (action, frames) in [(PinAction::Hold, quiet), (PinAction::Release, substeps)] {
            let pins = (144..288).map(|particle| PinControl { particle, action }).collect();
            solver.set_control(&Control { pins, ..Control::default() }).unwrap();
            for _ in 0..frames {
                solver.advance(frame).unwrap();
                if asks {
                    solver.synchronize().unwrap();
                }
            }
        }
        let mut state = State::default();
        solver.download(&mut state).unwrap();
        state
    });
    let change = torn_change(&states[0], substeps);
    assert!(change > 10.0, "the sheets touched: {change}");
    assert_eq!(first_difference(&states[0], &states[1]), None);
}

/// Sheets that lie on each other, and others further away that touch nothing.
fn layers(others: &[u32]) -> Arc<cloth_core::Model> {
    let spacing = 0.02;
    let mut builder = ModelBuilder::new().self_contact(SelfContact {
        distance: 0.8 * spacing,
        response: ContactResponse::Penalty { stiffness: 10.0, damping: 2e-3 },
    });
    let layers = (0..6).map(|layer| (20, 0.007 * f64::from(layer)));
    for (number, (side, height)) in layers.chain(others.iter().map(|&side| (side, 3.0))).enumerate()
    {
        let patch = GridPatch::horizontal(side, spacing, height);
        builder = builder.cloth(grid_cloth(&number.to_string(), patch, material(1e-4, 10.0, 5e-3)));
    }
    Arc::new(builder.build().unwrap())
}

#[test]
fn few_and_many_groups_give_the_same_bits() {
    let particles = 6 * 20 * 20;
    let config = SolverConfig { time_step: 1e-4, strain_bound: 1e3, ..SolverConfig::default() };
    let [few, many] = [&[][..], &[FAR_SIDE]].map(|others| {
        let model = layers(others);
        assert_eq!(model.particle_count().div_ceil(32) > 1024, !others.is_empty());
        let mut solver = gpu().create_solver(model, &config).unwrap();
        for _ in 0..3 {
            solver.advance(Frame { duration: 8.0 * config.time_step }).unwrap();
        }
        let report = solver.synchronize().unwrap();
        assert!(report.contacts > particles as u64, "{}", report.contacts);
        let mut state = State::default();
        solver.download(&mut state).unwrap();
        state.positions.truncate(particles);
        state.velocities.truncate(particles);
        state.held.truncate(particles);
        state
    });
    assert_eq!(first_difference(&few, &many), None);
}
