//! Halving the time step halves the error: symplectic Euler and backward Euler are of first order.

use cloth_core::{GridPatch, ModelBuilder};
use glam::DVec3;
use harness::{
    backends::reference,
    models::{grid_cloth, material},
};

use crate::{
    oscillator::{AMPLITUDE, angular_frequency, elongation, oscillator},
    rig::{advance, build, in_double, integrators, solver_of},
};

/// Asserts that errors at time steps that are halved each time shrink by two.
fn assert_first_order(errors: &[f64]) {
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 1.0).abs() < 0.1, "order {order} of errors {errors:?}");
    }
}

#[test]
fn the_oscillator_converges_to_the_cosine() {
    let model = oscillator();
    for candidate in in_double() {
        for integrator in integrators(candidate) {
            // Damping of a whole second by backward Euler, e^(-w^2 h / 2), is small only in the finest.
            let errors = [4000_u32, 8000, 16_000].map(|steps| {
                let time_step = 1.0 / f64::from(steps);
                let mut solver = solver_of(candidate, &model, time_step, integrator.clone());
                let found = elongation(&advance(&mut *solver, steps, time_step).positions);
                (found - AMPLITUDE * angular_frequency().cos()).abs()
            });
            assert_first_order(&errors);
        }
    }
}

#[test]
fn a_patch_converges() {
    let patch = GridPatch::horizontal(6, 0.1, 0.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 20.0, 1e-3));
    cloth.pins = vec![0, 5];
    let model = build(ModelBuilder::new().cloth(cloth));
    for integrator in integrators(reference()) {
        let run = |steps: u32| {
            let time_step = 0.1 / f64::from(steps);
            let mut solver = solver_of(reference(), &model, time_step, integrator.clone());
            advance(&mut *solver, steps, time_step).positions
        };
        // There is no exact answer: differences of successive refinements shrink in the same way.
        let runs = [200, 400, 800, 1600].map(run);
        let errors: Vec<f64> = runs
            .windows(2)
            .map(|pair| {
                let distances = pair[0].iter().zip(&pair[1]);
                distances
                    .map(|(a, b)| DVec3::from(*a).distance(DVec3::from(*b)))
                    .fold(0.0, f64::max)
            })
            .collect();
        assert_first_order(&errors);
    }
}
