//! Candidate lists that do not fit or are used too long: frames are done again, nothing is lost.

use std::sync::Arc;

use cloth_core::{
    Backend, ContactResponse, Frame, GridPatch, ModelBuilder, Precision, SelfContact, SolverConfig,
    State,
};
use harness::{
    backends::{cpu, gpu},
    models::{grid_cloth, material},
};

/// Sheets so close to each other that every particle is in contact with hundreds.
fn pile() -> Arc<cloth_core::Model> {
    let spacing = 0.02;
    let mut builder = ModelBuilder::new().self_contact(SelfContact {
        distance: 3.9 * spacing,
        response: ContactResponse::Penalty { stiffness: 0.01, damping: 0.0 },
    });
    for layer in 0..6 {
        let patch = GridPatch::horizontal(16, spacing, 0.001 * f64::from(layer));
        let name = format!("layer {layer}");
        builder = builder.cloth(grid_cloth(&name, patch, material(1e-4, 10.0, 1e-3)));
    }
    Arc::new(builder.build().unwrap())
}

#[test]
fn a_full_candidate_list_grows_and_the_frame_is_done_again() {
    let model = pile();
    let config = SolverConfig { strain_bound: 1e3, ..SolverConfig::default() };
    let mut solver = gpu().create_solver(Arc::clone(&model), &config).unwrap();
    solver.advance(Frame { duration: 2e-3 }).unwrap();
    let report = solver.synchronize().unwrap();
    // Far above the sixteen for each particle that there is room for at first.
    assert!(report.contact_candidates > 50 * model.particle_count() as u64);
    let mut found = State::default();
    solver.download(&mut found).unwrap();

    let reference = SolverConfig { precision: Precision::F64, ..config };
    let mut solver = cpu(2).create_solver(model, &reference).unwrap();
    solver.advance(Frame { duration: 2e-3 }).unwrap();
    assert_eq!(report.contacts, solver.synchronize().unwrap().contacts);
    let mut expected = State::default();
    solver.download(&mut expected).unwrap();
    for (found, expected) in found.velocities.iter().zip(&expected.velocities) {
        for (found, expected) in found.iter().zip(expected) {
            // Two substeps at 1e-4 kg: forces of up to 0.1 N give velocities of about 1 m/s.
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }
}

/// A sheet that flies through another one, so fast that it touches it in a single substep. When the list was
/// built they were four cells apart, and it would not be built again until they are past each other.
#[test]
fn a_list_that_is_used_too_long_is_built_more_often() {
    let spacing = 0.02;
    let response = ContactResponse::Penalty { stiffness: 5.0, damping: 0.0 };
    let sheet = |name, height| {
        let patch = GridPatch::horizontal(12, spacing, height);
        grid_cloth(name, patch, material(1e-3, 10.0, 1e-3))
    };
    let mut fast = sheet("fast", 0.308);
    fast.velocity = [0.0, 0.0, -400.0];
    let model = ModelBuilder::new()
        .cloth(sheet("resting", 0.0))
        .cloth(fast)
        .self_contact(SelfContact { distance: 0.8 * spacing, response })
        .build()
        .unwrap();
    let model = Arc::new(model);
    let config = SolverConfig { time_step: 2.5e-4, strain_bound: 1e3, ..SolverConfig::default() };
    let run = |backend: &dyn Backend, precision| {
        let config = SolverConfig { precision, ..config.clone() };
        let mut solver = backend.create_solver(Arc::clone(&model), &config).unwrap();
        solver.advance(Frame { duration: 8.0 * 2.5e-4 }).unwrap();
        solver.synchronize().unwrap();
        let mut state = State::default();
        solver.download(&mut state).unwrap();
        state
    };
    let found = run(gpu(), Precision::F32);
    let expected = run(&cpu(2), Precision::F64);
    let momentum = |state: &State| state.velocities[..144].iter().map(|v| v[2]).sum::<f64>();
    let [found, expected] = [momentum(&found), momentum(&expected)];
    let fallen = -144.0 * 9.81 * 8.0 * 2.5e-4;
    assert!(expected < fallen - 1.0, "the sheets touched: {expected} {fallen}");
    assert!((found - expected).abs() < 1e-3, "{found} {expected}");
}
