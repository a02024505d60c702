//! Free flight and the division of frames into substeps.

use cloth_core::{Frame, GridPatch, ModelBuilder};
use glam::DVec3;
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
};

use crate::rig::{
    GRAVITY, advance, build, download, in_double, integrators, particles, solver, solver_of,
};

/// Internal forces do not move the centre of mass, and symplectic Euler and backward Euler add up the first integers:
/// after n steps of h from height z and velocity v it is at z + v n h - g h^2 n (n + 1) / 2.
#[test]
fn the_centre_of_mass_of_a_patch_flies_as_a_point() {
    let time_step = 1e-3;
    let velocity = [1.0, -0.5, 3.0];
    let patch = GridPatch::horizontal(7, 0.1, 1.0);
    let mut cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    cloth.velocity = velocity;
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates() {
        let steps = candidate.work(500);
        let n = f64::from(steps);
        let fall = GRAVITY * time_step * time_step * n * (n + 1.0) / 2.0;
        // A deformation, so that the springs pull all the time.
        let mut state = model.initial_state();
        state.positions.iter_mut().for_each(|x| x[0] *= 1.1 + x[1]);
        let state = candidate.rounded(&state);
        let start = centre(&state.positions);
        let expected = start + DVec3::from(velocity) * n * time_step - DVec3::Z * fall;
        // 1e-10 m in f64. Each step rounds once a velocity of some m/s, whose error counts for all
        // the steps to come, and once a position: n^2/2 h eps |v| + n eps |x|.
        let epsilon = candidate.epsilon();
        let tolerance = 1e-10_f64.max(epsilon * (n * n / 2.0 * time_step * 4.0 + n * 2.0));
        for integrator in integrators(candidate) {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            solver.upload(&state).unwrap();
            let end = centre(&advance(&mut *solver, steps, time_step).positions);
            let error = (end - expected).length();
            assert!(error <= tolerance, "{}: {end} instead of {expected}", candidate.label);
        }
    }
}

/// Particles that no spring holds fall alike, as many as there are.
#[test]
fn particles_without_springs_fall_as_points() {
    let time_step = 1e-2;
    for count in [1, 20, 53, 300] {
        let positions: Vec<[f64; 3]> = (0..count).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let model = build(ModelBuilder::new().cloth(particles(&positions, [0.0; 3])));
        for candidate in candidates() {
            for integrator in integrators(candidate) {
                let mut solver = solver_of(candidate, &model, time_step, integrator);
                let steps = 10;
                let height =
                    -GRAVITY * time_step * time_step * f64::from(steps * (steps + 1)) / 2.0;
                for end in advance(&mut *solver, steps, time_step).positions {
                    let error = (end[2] - height).abs();
                    assert!(error <= 100.0 * candidate.epsilon(), "{}: {end:?}", candidate.label);
                }
            }
        }
    }
}

fn centre(positions: &[[f64; 3]]) -> DVec3 {
    positions.iter().copied().map(DVec3::from).sum::<DVec3>() / positions.len() as f64
}

/// A thirtieth of a second at 1 kHz: 33 substeps of 1 ms and a last one of a third of that, in which
/// the particle falls less.
#[test]
fn the_last_substep_of_a_frame_is_shorter() {
    let time_step = 1e-3;
    let model = build(ModelBuilder::new().cloth(particles(&[[0.0; 3]], [0.0; 3])));
    for candidate in in_double() {
        let mut solver = solver(candidate, &model, time_step);
        let [mut height, mut velocity] = [0.0, 0.0];
        for frame in 1..=3_u32 {
            solver.advance(Frame::per_second(30.0)).unwrap();
            let report = solver.synchronize().unwrap();
            assert_eq!(report.substeps, 34);
            assert!((report.time - f64::from(frame) / 30.0).abs() < 1e-15);
            for step in 0..34 {
                let length = if step == 33 { 1.0 / 30.0 - 0.033 } else { time_step };
                velocity -= GRAVITY * length;
                height += velocity * length;
            }
            let state = download(&mut *solver);
            assert_eq!(state.step, u64::from(34 * frame));
            assert!((state.positions[0][2] - height).abs() < 1e-12, "{}", candidate.label);
        }
    }
}
