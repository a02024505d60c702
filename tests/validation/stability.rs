//! The stability limit of symplectic Euler, h < 2/omega_max, from both sides.

use cloth_core::{DivergenceCause, Error, Frame, Precision, SolverConfig};
use harness::backends::candidates;

use crate::{
    oscillator::{AMPLITUDE, angular_frequency, elongation, oscillator},
    rig::{advance, assert_close, solver},
};

#[test]
fn just_below_the_limit_the_motion_stays_bounded() {
    let model = oscillator();
    let time_step = 0.98 * 2.0 / angular_frequency();
    // Discrete amplitude: a sqrt(1 + tan^2(w' h / 2)), large close to the limit but bounded.
    let half_angle = (0.98_f64).asin();
    let bound = AMPLITUDE / half_angle.cos();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step);
        for _ in 0..200 {
            let found = elongation(&advance(&mut *solver, 11, time_step).positions);
            assert!(found.abs() <= 1.001 * bound, "{}: {found} of {bound}", candidate.label);
        }
    }
}

#[test]
fn just_above_the_limit_it_diverges_and_says_so() {
    let model = oscillator();
    let limit = 2.0 / angular_frequency();
    let time_step = 1.02 * limit;
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step);
        let error = (0..100).find_map(|_| {
            solver.advance(Frame { duration: 10.0 * time_step }).unwrap();
            solver.synchronize().err()
        });
        let Some(Error::Diverged(divergence)) = error else {
            panic!("{}: {error:?} instead of a divergence", candidate.label);
        };
        // The amplitude grows from 0.05 towards the bound 10, by e^(2 acosh(1.02)) in each step, and
        // more slowly once the masses swing through each other and the spring is no longer linear.
        let growth = 2.0 * (1.02_f64).acosh();
        let expected = ((10.0 / AMPLITUDE).ln() / growth) as u64;
        assert!(
            (expected..=4 * expected).contains(&divergence.step),
            "{}: at step {} instead of {expected}",
            candidate.label,
            divergence.step
        );
        assert_eq!(divergence.step % 10, 0, "found at the end of a frame");
        assert_close("time", divergence.time, divergence.step as f64 * time_step, 1e-9);
        assert!(divergence.particle < 2);
        assert!(matches!(divergence.cause, DivergenceCause::Strain { strain, bound }
            if strain > bound && bound == 10.0));
        assert_eq!(divergence.time_step, time_step);
        let stable = divergence.stable_time_step.expect("the explicit one has a limit");
        assert_close("stable time step", stable, limit, 0.01);
    }
}

/// Far above the limit numbers overflow within a frame; the report names the substep.
#[test]
fn an_overflow_is_reported_with_its_substep() {
    let model = oscillator();
    let time_step = 10.0 * 2.0 / angular_frequency();
    for candidate in candidates() {
        let config = SolverConfig {
            precision: candidate.precision,
            time_step,
            strain_bound: f64::MAX,
            ..SolverConfig::default()
        };
        let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
        solver.advance(Frame { duration: 1000.0 * time_step }).unwrap();
        let error = solver.synchronize();
        let Err(Error::Diverged(divergence)) = error else {
            panic!("{}: {error:?} instead of a divergence", candidate.label);
        };
        assert_eq!(divergence.cause, DivergenceCause::NonFinite);
        assert!(divergence.particle < 2);
        // Each step multiplies the amplitude by about (omega h)^2 = 400, a little less while it is
        // small, until its square overflows; the step after that has no length to divide by.
        let largest = match candidate.precision {
            Precision::F32 => f64::from(f32::MAX),
            Precision::F64 => f64::MAX,
        };
        let expected = (largest.sqrt() / AMPLITUDE).ln() / 400.0_f64.ln();
        let late = divergence.step as f64 - expected;
        assert!((0.0..4.0).contains(&late), "{}: {late} steps late", candidate.label);
    }
}
