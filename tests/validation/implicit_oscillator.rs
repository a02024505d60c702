//! One spring, of which the steps of backward Euler are known in closed form.
//!
//! For x'' = -w^2 x and z = x + i v/w, backward Euler is z' = z / (1 + i w h): each step divides the
//! amplitude by sqrt(1 + (w h)^2) and turns the phase by atan(w h) (Hairer and Wanner 1996, "Solving
//! Ordinary Differential Equations II", section IV.3).

use harness::{backends::candidates_with, feature::Feature};

use crate::{
    oscillator::{AMPLITUDE, REST_LENGTH, angular_frequency, elongation, oscillator},
    rig::{advance, implicit, in_double, solver_of},
};

#[test]
fn amplitude_and_phase_of_every_step_are_those_of_backward_euler() {
    let model = oscillator();
    for step_angle in [0.05, 0.5, 3.0] {
        let time_step = step_angle / angular_frequency();
        let [factor, phase] = [(1.0 + step_angle * step_angle).sqrt().recip(), step_angle.atan()];
        for candidate in candidates_with(Feature::Implicit) {
            let mut solver = solver_of(candidate, &model, time_step, implicit(candidate, 1e-12));
            let steps = 30;
            for step in 1..=steps {
                let found = elongation(&advance(&mut *solver, 1, time_step).positions);
                let expected = AMPLITUDE * factor.powi(step) * (f64::from(step) * phase).cos();
                // Each step rounds positions of the size of the rest length, and velocities, which
                // count h times.
                let rounding = f64::from(step) * 4.0 * REST_LENGTH * candidate.epsilon();
                let tolerance = 1e-6 * AMPLITUDE * factor.powi(step) * f64::from(step) + rounding;
                let error = (found - expected).abs();
                assert!(
                    error <= tolerance.min(1e-6_f64.max(rounding)),
                    "{} after {step}: {error:e} of {tolerance:e}",
                    candidate.label
                );
            }
        }
    }
}

/// The two figures themselves, from three positions in a row: x'' = 2 r cos(p) x' - r^2 x.
#[test]
fn damping_and_frequency_are_within_a_millionth() {
    let model = oscillator();
    for step_angle in [0.05_f64, 0.5, 3.0] {
        let time_step = step_angle / angular_frequency();
        for candidate in in_double() {
            let mut solver = solver_of(candidate, &model, time_step, implicit(candidate, 1e-12));
            let x: Vec<f64> = (0..4)
                .map(|_| elongation(&advance(&mut *solver, 1, time_step).positions))
                .collect();
            // Two equations for the two coefficients.
            let determinant = x[1] * x[1] - x[0] * x[2];
            let sum = (x[1] * x[2] - x[0] * x[3]) / determinant;
            let product = (x[2] * x[2] - x[1] * x[3]) / determinant;
            let factor = product.sqrt();
            let phase = (0.5 * sum / factor).acos();
            let expected = (1.0 + step_angle * step_angle).sqrt().recip();
            assert!((factor / expected - 1.0).abs() < 1e-6, "amplitude {factor} of {expected}");
            let ratio = phase / step_angle;
            let expected = step_angle.atan() / step_angle;
            assert!((ratio / expected - 1.0).abs() < 1e-6, "phase {ratio} of {expected}");
        }
    }
}
