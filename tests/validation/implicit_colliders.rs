//! Colliders in the implicit step: what their constraints hold, and what they must let go.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, Frame, GridPatch, Model, ModelBuilder, Pose,
};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates_with},
    feature::Feature,
    models::{grid_cloth, material},
};

use crate::rig::{
    GRAVITY, THICKNESS, advance, assert_close, build, chain, download, implicit, particles,
    solver_of,
};

const TIME_STEP: f64 = 1.0 / 60.0;

fn solid(shape: ColliderShape, pose: Pose, friction: f64) -> Collider {
    Collider { name: "solid".into(), shape, pose, friction, restitution: 0.0 }
}

fn incline(angle: f64, friction: f64) -> (Arc<Model>, DVec3) {
    let normal = [angle.sin(), 0.0, angle.cos()];
    let start = normal.map(|component| 0.5 * THICKNESS * component);
    let plane = solid(ColliderShape::Plane, Pose::from_z_axis([0.0; 3], normal), friction);
    let model = build(ModelBuilder::new().cloth(particles(&[start], [0.0; 3])).collider(plane));
    (model, start.into())
}

/// Below the angle of friction a particle stays where it is, for as long as one likes: what friction holds
/// is a constraint, not a brake.
#[test]
fn a_particle_below_the_angle_of_friction_does_not_creep() {
    for friction in [0.2_f64, 0.6, 1.0] {
        for share in [0.3, 0.9, 0.99] {
            let (model, start) = incline(share * friction.atan(), friction);
            for candidate in candidates_with(Feature::Implicit) {
                let mut solver = solver_of(candidate, &model, TIME_STEP, implicit(candidate, 1e-9));
                let steps = candidate.work(200);
                let end = advance(&mut *solver, steps, TIME_STEP);
                let way = DVec3::from(end.positions[0]).distance(start);
                // Rounding of the position in each step.
                let tolerance = f64::from(steps) * THICKNESS * candidate.epsilon();
                assert!(way <= tolerance, "{}: creeps by {way:e} m", candidate.label);
            }
        }
    }
}

/// Above it, it slides with g (sin - mu cos), exactly, as friction comes from the force of the
/// constraint.
#[test]
fn a_particle_above_the_angle_of_friction_slides_as_galilei_and_coulomb_say() {
    for friction in [0.2_f64, 0.6, 1.0] {
        for more in [0.05, 0.3] {
            let angle = friction.atan() + more;
            let (model, start) = incline(angle, friction);
            for candidate in candidates_with(Feature::Implicit) {
                let mut solver = solver_of(candidate, &model, TIME_STEP, implicit(candidate, 1e-9));
                let steps = 60;
                let end = advance(&mut *solver, steps, TIME_STEP);
                let acceleration = GRAVITY * (angle.sin() - friction * angle.cos());
                let n = f64::from(steps);
                let speed = acceleration * n * TIME_STEP;
                let relative = 1e-9_f64.max(100.0 * n * candidate.epsilon());
                let found = DVec3::from(end.velocities[0]).length();
                assert_close(&format!("{}: speed", candidate.label), found, speed, relative);
                let way = acceleration * TIME_STEP * TIME_STEP * n * (n + 1.0) / 2.0;
                let found = DVec3::from(end.positions[0]).distance(start);
                assert_close(&format!("{}: way", candidate.label), found, way, relative);
            }
        }
    }
}

/// A cloth falls in steps of a sixtieth of a second: it ends on the solid, not in it, and at rest.
#[test]
fn a_falling_cloth_comes_to_rest_on_a_plane_and_on_a_ball() {
    let ground = solid(ColliderShape::Plane, Pose::IDENTITY, 0.5);
    let radius = 0.15;
    let ball = Collider {
        name: "ball".into(),
        ..solid(ColliderShape::Sphere { radius }, Pose::IDENTITY, 0.5)
    };
    for on_ball in [false, true] {
        let mut fabric = material(1e-3, 50.0, THICKNESS);
        fabric.stretch.damping = 0.01;
        let patch = GridPatch::horizontal(9, 0.05, 0.4);
        let mut builder = ModelBuilder::new()
            .cloth(grid_cloth("patch", patch, fabric))
            .collider(ground.clone())
            .field(cloth_core::Field::Drag { rate: [1.0; 3] });
        if on_ball {
            builder = builder.collider(ball.clone());
        }
        let model = build(builder);
        for candidate in candidates_with(Feature::Implicit) {
            let mut solver = solver_of(candidate, &model, TIME_STEP, implicit(candidate, 1e-3));
            let mut kinetic = 0.0;
            for _ in 0..240 {
                solver.advance(Frame { duration: TIME_STEP }).unwrap();
                let measures = solver.synchronize().unwrap().measures;
                assert!(
                    measures.penetration_max <= 4.0 * candidate.epsilon(),
                    "{}: {:e} m inside",
                    candidate.label,
                    measures.penetration_max
                );
                kinetic = measures.energy_kinetic;
            }
            let state = download(&mut *solver);
            let highest = state.positions.iter().map(|x| x[2]).fold(f64::NEG_INFINITY, f64::max);
            let expected = if on_ball { radius } else { 0.0 } + 0.5 * THICKNESS;
            assert!((highest - expected).abs() < 0.02, "{}: at {highest}", candidate.label);
            // Of the 1.1 J that it fell with.
            assert!(kinetic < 1e-4, "{}: {kinetic} J in motion", candidate.label);
        }
    }
}

/// A floor pushes and does not pull: a spring lifts the particle on it as if it were not there.
#[test]
fn a_contact_that_would_have_to_pull_is_released() {
    let place = 0.5 * THICKNESS;
    let mut cloth = chain(vec![[0.0, 0.0, 1.0], [0.0, 0.0, place]], &[0.4], 0.1, 20.0);
    cloth.pins = vec![0];
    let free = build(ModelBuilder::new().cloth(cloth.clone()));
    let floor = solid(ColliderShape::Plane, Pose::IDENTITY, 0.8);
    let floored = build(ModelBuilder::new().cloth(cloth).collider(floor));
    for candidate in candidates_with(Feature::Implicit) {
        let run = |model: &Arc<Model>| {
            let mut solver = solver_of(candidate, model, TIME_STEP, implicit(candidate, 1e-9));
            let first = advance(&mut *solver, 1, TIME_STEP);
            (first, advance(&mut *solver, 5, TIME_STEP))
        };
        let [(free, free_later), (found, found_later)] = [run(&free), run(&floored)];
        for (free, found) in [(free, found), (free_later, found_later)] {
            assert!(free.velocities[1][2] > 0.1, "the spring lifts it");
            let error = (found.velocities[1][2] - free.velocities[1][2]).abs();
            assert!(error <= 200.0 * candidate.epsilon(), "{}: {error:e}", candidate.label);
        }
    }
}

/// A cloth that touches a ceiling from below falls as any other.
#[test]
fn a_ceiling_does_not_hold_a_cloth() {
    let ceiling = solid(ColliderShape::Plane, Pose::from_z_axis([0.0; 3], [0.0, 0.0, -1.0]), 1.0);
    let patch = GridPatch::horizontal(5, 0.05, -0.5 * THICKNESS);
    let cloth = grid_cloth("patch", patch, material(1e-3, 50.0, THICKNESS));
    let model = build(ModelBuilder::new().cloth(cloth).collider(ceiling));
    for candidate in candidates_with(Feature::Implicit) {
        let mut solver = solver_of(candidate, &model, TIME_STEP, implicit(candidate, 1e-9));
        let state = advance(&mut *solver, 12, TIME_STEP);
        let fall = GRAVITY * TIME_STEP * TIME_STEP * 12.0 * 13.0 / 2.0;
        for x in &state.positions {
            assert_close("fall", -x[2] - 0.5 * THICKNESS, fall, 1e-5);
        }
    }
}

/// What lies on a plate that is lifted goes up with it, to the last digit, and a plate that is turned
/// away under it leaves it behind.
#[test]
fn a_lifted_plate_carries_the_cloth() {
    let patch = GridPatch::horizontal(5, 0.05, 0.5 * THICKNESS);
    let cloth = grid_cloth("patch", patch, material(1e-3, 50.0, THICKNESS));
    let plate = solid(ColliderShape::Plane, Pose::IDENTITY, 0.9);
    let model = build(ModelBuilder::new().cloth(cloth).collider(plate));
    for candidate in candidates_with(Feature::Implicit) {
        let mut solver = solver_of(candidate, &model, TIME_STEP, implicit(candidate, 1e-9));
        let move_to = |height: f64| Control {
            colliders: vec![ColliderControl {
                collider: 0,
                pose: Pose::from_translation([0.0, 0.0, height]),
            }],
            ..Control::default()
        };
        for frame in 1..=30 {
            let height = 0.01 * f64::from(frame);
            solver.set_control(&move_to(height)).unwrap();
            let state = advance(&mut *solver, 1, TIME_STEP);
            assert_heights(candidate, &state.positions, height + 0.5 * THICKNESS, 1e-6);
        }
        // Down faster than the cloth falls: it is thrown up, and left in the air.
        solver.set_control(&move_to(-2.0)).unwrap();
        let state = advance(&mut *solver, 1, TIME_STEP);
        let thrown = 0.3 + 0.5 * THICKNESS + 0.01 - GRAVITY * TIME_STEP * TIME_STEP;
        assert_heights(candidate, &state.positions, thrown, 1e-5);
    }
}

fn assert_heights(candidate: &Candidate, positions: &[[f64; 3]], expected: f64, tolerance: f64) {
    for (i, x) in positions.iter().enumerate() {
        assert!(
            (x[2] - expected).abs() <= tolerance,
            "{}: particle {i} at {} instead of {expected}",
            candidate.label,
            x[2]
        );
    }
}
