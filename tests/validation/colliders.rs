//! Rebound from colliders, and colliders that move.

use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, Frame, GridPatch, ModelBuilder, Pose,
};
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
};

use crate::rig::{
    GRAVITY, THICKNESS, advance, assert_close, build, download, integrators, particles, solver_of,
};

fn plane(friction: f64, restitution: f64) -> Collider {
    Collider {
        name: "plane".into(),
        shape: ColliderShape::Plane,
        pose: Pose::IDENTITY,
        friction,
        restitution,
    }
}

/// Newton's law of impact (1687): a body that falls from height h rebounds to e^2 h. Only the last centimetre of its fall is
/// simulated and the beginning of its rise; the rest is free flight.
#[test]
fn a_particle_rebounds_to_the_square_of_the_restitution() {
    let [height, last, time_step] = [0.5, 0.01, 1e-4];
    let speed = (2.0 * GRAVITY * (height - last)).sqrt();
    for restitution in [0.3, 0.7, 1.0] {
        let cloth = particles(&[[0.0, 0.0, last + 0.5 * THICKNESS]], [0.0, 0.0, -speed]);
        let model = build(ModelBuilder::new().cloth(cloth).collider(plane(0.0, restitution)));
        for candidate in candidates() {
            for integrator in integrators(candidate) {
                let mut solver = solver_of(candidate, &model, time_step, integrator);
                let steps = (2.0 * last / speed / time_step) as u32;
                let state = advance(&mut *solver, steps, time_step);
                let velocity = state.velocities[0][2];
                assert!(velocity > 0.0, "it has not come back: {velocity} m/s");
                let rise = velocity * velocity / (2.0 * GRAVITY);
                let top = state.positions[0][2] - 0.5 * THICKNESS + rise;
                assert_close("rebound", top, restitution * restitution * height, 0.01);
            }
        }
    }
}

/// A table that starts to move at speed u carries the cloth on it: friction accelerates it by mu g,
/// so that it slips back by u^2 / (2 mu g) before it moves along.
#[test]
fn a_moving_table_carries_the_cloth_on_it() {
    let [friction, speed, time_step] = [0.5, 0.6, 1e-3];
    let patch = GridPatch::horizontal(5, 0.05, 0.5 * THICKNESS);
    let cloth = grid_cloth("patch", patch, material(1e-3, 10.0, THICKNESS));
    let model = build(ModelBuilder::new().cloth(cloth).collider(plane(friction, 0.0)));
    for candidate in candidates() {
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            let frames = 20;
            let frame = Frame { duration: 0.02 };
            for number in 1..=frames {
                let x = speed * frame.duration * f64::from(number);
                // Down as well: an inclined path, the cloth must not be left in the air.
                let pose = Pose::from_translation([x, 0.0, 0.1 * x]);
                let control = Control {
                    colliders: vec![ColliderControl { collider: 0, pose }],
                    ..Control::default()
                };
                solver.set_control(&control).unwrap();
                solver.advance(frame).unwrap();
                solver.synchronize().unwrap();
            }
            let travelled = speed * frame.duration * f64::from(frames);
            let slip = speed * speed / (2.0 * friction * GRAVITY);
            let state = download(&mut *solver);
            for (i, (x, v)) in state.positions.iter().zip(&state.velocities).enumerate() {
                let start = model.positions()[i];
                assert_close("speed", v[0], speed, 1e-3);
                assert_close("way", x[0] - start[0], travelled - slip, 0.02);
                assert_close("height", x[2], 0.1 * travelled + 0.5 * THICKNESS, 1e-3);
            }
        }
    }
}
