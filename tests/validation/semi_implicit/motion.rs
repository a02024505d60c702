//! Motions that are known: an oscillator, a hanging chain, a body on an incline.

use cloth_core::{Collider, ColliderShape, ModelBuilder, Pose, Precision};
use harness::{
    backends::{candidates_with, reference},
    feature::Feature,
};

use super::SEMI_IMPLICIT;
use crate::{
    chain::{CATENARY_LINKS, CATENARY_SAG, catenary},
    oscillator::{angular_frequency, elongation, oscillator},
    rig::{THICKNESS, advance, assert_close, build, particles, solver_of},
};

/// Along its axis a spring is what the constant matrix takes it for, so that the step is backward
/// Euler: z = x - i v / omega is multiplied by 1 / (1 - i omega h), of magnitude
/// (1 + (omega h)^2)^-1/2 and angle atan(omega h).
#[test]
fn an_oscillator_loses_the_amplitude_and_phase_of_backward_euler() {
    let model = oscillator();
    let omega = angular_frequency();
    let offered = candidates_with(Feature::SemiImplicit);
    for candidate in offered.filter(|candidate| candidate.precision == Precision::F64) {
        for step_angle in [0.05, 0.3, 1.0] {
            let time_step = step_angle / omega;
            let mut solver = solver_of(candidate, &model, time_step, SEMI_IMPLICIT);
            let mut amplitude = None;
            let mut phase = None;
            for _ in 0..10 {
                let state = advance(&mut *solver, 1, time_step);
                let x = elongation(&state.positions);
                let v = state.velocities[1][0] - state.velocities[0][0];
                let (radius, angle) = (x.hypot(v / omega), (-v / omega).atan2(x));
                if let Some(before) = amplitude.replace(radius) {
                    let expected = 1.0 / step_angle.hypot(1.0);
                    assert_close("amplitude", radius / before, expected, 1e-6);
                }
                if let Some(before) = phase.replace(angle) {
                    let turned = (angle - before).rem_euclid(std::f64::consts::TAU);
                    assert_close(
                        "phase",
                        turned / step_angle,
                        step_angle.atan() / step_angle,
                        1e-6,
                    );
                }
            }
        }
    }
}

/// The matrix takes the springs for as stiff across as along, which slows turns down to a rate of T / (h k l), T the
/// tension: the springs are softer here than for the other integrators, so that it is 0.5 per second, and stretch
/// by 0.1%.
#[test]
fn a_chain_between_two_points_hangs_in_the_catenary() {
    let model = catenary(400.0, 4.0);
    let mut solver = solver_of(reference(), &model, 1e-3, SEMI_IMPLICIT);
    let mut state = model.initial_state();
    while state.time < 13.5 {
        state = advance(&mut *solver, 1000, 1e-3);
    }
    assert_close("sag", -state.positions[CATENARY_LINKS / 2][2], CATENARY_SAG, 0.005);
}

/// Coulomb: a body on an incline slides above the angle atan(mu), and stays below.
#[test]
fn a_particle_slides_above_the_angle_of_friction() {
    let (friction, time_step) = (0.6_f64, 1e-2);
    for candidate in candidates_with(Feature::SemiImplicit) {
        for (degrees, slides) in [(-1.0_f64, false), (1.0, true)] {
            let angle = friction.atan() + degrees.to_radians();
            let normal = [angle.sin(), 0.0, angle.cos()];
            let plane = Collider {
                name: "plane".into(),
                shape: ColliderShape::Plane,
                pose: Pose::from_z_axis([0.0; 3], normal),
                friction,
                restitution: 0.0,
            };
            let cloth = particles(&[normal.map(|c| 0.5 * THICKNESS * c)], [0.0; 3]);
            let model = build(ModelBuilder::new().cloth(cloth).collider(plane));
            let mut solver = solver_of(candidate, &model, time_step, SEMI_IMPLICIT);
            let end = advance(&mut *solver, 50, time_step);
            let speed = end.velocities[0].iter().map(|v| v * v).sum::<f64>().sqrt();
            assert_eq!(speed > 1e-3, slides, "{}: {speed} m/s", candidate.label);
        }
    }
}
