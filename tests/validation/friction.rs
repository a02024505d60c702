//! Coulomb's law (1785) on a plane: when a body starts to slide, and how far it goes.

use cloth_core::{Collider, ColliderShape, ModelBuilder, Pose};
use glam::DVec3;
use harness::backends::{Candidate, candidates};

use crate::rig::{GRAVITY, THICKNESS, advance, assert_close, build, particles, solver};

const TIME_STEP: f64 = 1e-3;
const STEPS: u32 = 500;
/// A particle slower than this \[m/s\] after half a second did not slide.
const SPEED_AT_REST: f64 = 1e-3;

fn plane(pose: Pose, friction: f64) -> Collider {
    Collider { name: "plane".into(), shape: ColliderShape::Plane, pose, friction, restitution: 0.0 }
}

/// Speed \[m/s\] of a particle after half a second on a plane tilted by `angle` \[rad\], and how far it
/// went \[m\].
fn slide(candidate: &Candidate, friction: f64, angle: f64) -> [f64; 2] {
    let normal = [angle.sin(), 0.0, angle.cos()];
    let pose = Pose::from_z_axis([0.0; 3], normal);
    let start = normal.map(|component| 0.5 * THICKNESS * component);
    let cloth = particles(&[start], [0.0; 3]);
    let model = build(ModelBuilder::new().cloth(cloth).collider(plane(pose, friction)));
    let mut solver = solver(candidate, &model, TIME_STEP);
    let end = advance(&mut *solver, STEPS, TIME_STEP);
    let [position, velocity] = [end.positions[0], end.velocities[0]].map(DVec3::from);
    [velocity.length(), position.distance(start.into())]
}

/// A body on an incline slides when the angle is above atan(mu).
#[test]
fn a_particle_slides_above_the_angle_of_friction() {
    for candidate in candidates() {
        for friction in [0.2_f64, 0.6, 1.0] {
            let [mut low, mut high] = [0.0, 1.4_f64];
            while high - low > 0.001 {
                let angle = 0.5 * (low + high);
                let [speed, way] = slide(candidate, friction, angle);
                // Half a degree above the angle it would be at some cm/s by now.
                if speed > SPEED_AT_REST {
                    high = angle;
                    continue;
                }
                low = angle;
                // Friction acts on the velocity, after the substep has moved the particle: even one
                // that is held creeps, by at most the fall of one substep in each.
                let creep = f64::from(STEPS) * GRAVITY * angle.sin() * TIME_STEP * TIME_STEP;
                let slid = SPEED_AT_REST * f64::from(STEPS) * TIME_STEP;
                assert!(way < 1.01 * creep + slid, "{}: creeps by {way} m", candidate.label);
            }
            let error = (low - friction.atan()).to_degrees();
            assert!(error.abs() < 1.0, "{}: mu {friction}, off by {error}", candidate.label);
        }
    }
}

/// A sliding body stops after v^2 / (2 mu g).
#[test]
fn a_sliding_particle_stops_after_the_braking_distance() {
    let [speed, friction] = [2.0, 0.4];
    let cloth = particles(&[[0.0, 0.0, 0.5 * THICKNESS]], [speed, 0.0, 0.0]);
    let model = build(ModelBuilder::new().cloth(cloth).collider(plane(Pose::IDENTITY, friction)));
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, TIME_STEP);
        let end = advance(&mut *solver, 1000, TIME_STEP);
        assert_eq!(end.velocities[0][0], 0.0, "{}: still slides", candidate.label);
        let expected = speed * speed / (2.0 * friction * GRAVITY);
        assert_close("braking distance", end.positions[0][0], expected, 0.01);
    }
}
