//! Two masses on a spring, the one oscillator whose discrete motion is known exactly.
//!
//! Symplectic Euler makes x'' = -w^2 x into x_(n+1) - 2 x_n + x_(n-1) = -(w h)^2 x_n, which a
//! harmonic motion solves with the frequency w' of cos(w' h) = 1 - (w h)^2 / 2 (Hairer, Lubich and
//! Wanner 2006, "Geometric Numerical Integration", section I.2).

use std::sync::Arc;

use cloth_core::{Model, ModelBuilder};
use harness::backends::candidates;

use crate::rig::{advance, build, chain, solver};

pub(crate) const MASS: f64 = 0.2;
pub(crate) const STIFFNESS: f64 = 40.0;
pub(crate) const REST_LENGTH: f64 = 1.0;
/// Elongation at the start \[m\].
pub(crate) const AMPLITUDE: f64 = 0.05;

/// Angular frequency \[rad/s\]: the reduced mass is m/2.
pub(crate) fn angular_frequency() -> f64 {
    (2.0 * STIFFNESS / MASS).sqrt()
}

/// The oscillator at its largest elongation, at rest.
pub(crate) fn oscillator() -> Arc<Model> {
    let positions = vec![[0.0; 3], [REST_LENGTH + AMPLITUDE, 0.0, 0.0]];
    let cloth = chain(positions, &[REST_LENGTH], MASS, STIFFNESS);
    build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth))
}

/// Elongation \[m\] of a state of the oscillator.
pub(crate) fn elongation(positions: &[[f64; 3]]) -> f64 {
    positions[1][0] - positions[0][0] - REST_LENGTH
}

#[test]
fn phase_and_amplitude_are_those_of_the_discrete_oscillator() {
    let model = oscillator();
    let time_step = 2e-3;
    let step_angle = angular_frequency() * time_step;
    let discrete_angle = (1.0 - step_angle * step_angle / 2.0).acos();
    // From x_0 = a and v_0 = 0 follows x_1 = a (1 - (w h)^2), which fixes the sine.
    let sine = (1.0 - step_angle * step_angle - discrete_angle.cos()) / discrete_angle.sin();
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step);
        for number in 1..=50 {
            let steps = 20 * number;
            let found = elongation(&advance(&mut *solver, 20, time_step).positions);
            let angle = f64::from(steps) * discrete_angle;
            let expected = AMPLITUDE * (angle.cos() + sine * angle.sin());
            // The discrete motion is neutrally stable: rounding errors of about 4 eps L of each step
            // stay as large as they are made, in x and, times 1/(w h), through v.
            let tolerance = f64::from(steps) * 4.0 * REST_LENGTH * candidate.epsilon() / step_angle;
            let error = (found - expected).abs();
            assert!(error <= tolerance, "{} after {steps}: {error:e}", candidate.label);
        }
    }
}
