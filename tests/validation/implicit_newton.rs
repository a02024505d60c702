//! Newton's method: the step is then backward Euler itself, not its linearisation.

use std::sync::Arc;

use cloth_core::{
    Frame, GridPatch, ImplicitSettings, Integrator, Model, ModelBuilder, NewtonSettings, Precision,
    State,
};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates_with},
    dense::{Dense, flat},
    feature::Feature,
    models::{grid_cloth, material},
    random::Random,
    stages::{Particles, spring_forces},
    tracked::TrackedVector,
};

use crate::{
    implicit_rig::network_model,
    rig::{build, download, in_double, solver_of},
};

fn newton(iterations_max: u32, tolerance: f64, linear: f64) -> Integrator {
    let mut settings = ImplicitSettings {
        newton: NewtonSettings { iterations_max, tolerance },
        ..ImplicitSettings::default()
    };
    settings.linear.tolerance = linear;
    settings.linear.iterations_max = 2000;
    Integrator::Implicit(settings)
}

/// M (v' - v) - h f(x + h v', v'), which backward Euler makes zero.
fn residual(model: &Model, start: &State, velocities: &[f64], h: f64) -> Vec<f64> {
    let mut state = start.clone();
    for (i, v) in velocities.chunks(3).enumerate() {
        state.velocities[i] = [v[0], v[1], v[2]];
        state.positions[i] = std::array::from_fn(|k| start.positions[i][k] + h * v[k]);
    }
    let mut forces = vec![TrackedVector::ZERO; state.len()];
    spring_forces(model, &Particles::new(model, &state, f64::EPSILON), &mut forces);
    let gravity = DVec3::from(model.gravity());
    let of = |i: usize| {
        let mass = model.masses()[i];
        let change = DVec3::from(state.velocities[i]) - DVec3::from(start.velocities[i]);
        mass * change - h * (DVec3::from(forces[i].values()) + mass * gravity)
    };
    (0..state.len()).flat_map(|i| of(i).to_array()).collect()
}

/// v' by Newton's method on differences, from a start that many small steps lead to.
fn brute_force(model: &Model, start: &State, h: f64) -> Vec<f64> {
    let mut velocities = flat(&start.velocities);
    // Follow the solution from a step of no length to the whole one.
    for part in 1..=64 {
        let h = h * f64::from(part) / 64.0;
        for _ in 0..20 {
            let value = residual(model, start, &velocities, h);
            let mut jacobian = Dense::zero(velocities.len());
            for column in 0..velocities.len() {
                let step = 1e-6;
                let at = |sign: f64| {
                    let mut moved = velocities.clone();
                    moved[column] += sign * step;
                    residual(model, start, &moved, h)
                };
                for (row, (up, down)) in at(1.0).iter().zip(at(-1.0)).enumerate() {
                    *jacobian.at(row, column) = (up - down) / (2.0 * step);
                }
            }
            let change = jacobian.solve(&value);
            velocities.iter_mut().zip(&change).for_each(|(v, change)| *v -= change);
        }
    }
    velocities
}

#[test]
fn newton_gives_the_solution_of_backward_euler() {
    let mut random = Random::new(31);
    let mut differ = 0;
    for case in 0..12 {
        let particles = 2 + case % 2;
        let model = network_model(particles, &mut random);
        let mut state = model.initial_state();
        for i in 0..state.len() {
            // Stretched two to five times, so that the equation has one solution.
            state.positions[i] = [0.3 * i as f64, 0.2 * ((i * i) as f64), 0.05 * i as f64];
            state.velocities[i] = random.vector(0.5);
        }
        let h = 2.0 * model.stable_time_step();
        let expected = brute_force(&model, &state, h);
        let left = residual(&model, &state, &expected, h);
        let size = residual(&model, &state, &flat(&state.velocities), h);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(largest(&left) <= 1e-11 * largest(&size), "the reference has not converged");
        for candidate in in_double() {
            let end = one_step(candidate, &model, &state, h, newton(200, 1e-12, 1e-13));
            let found = flat(&end.velocities);
            let error: Vec<f64> = found.iter().zip(&expected).map(|(a, b)| a - b).collect();
            assert!(
                largest(&error) <= 1e-8 * largest(&expected),
                "case {case}: {found:?}, expected {expected:?}"
            );
            // It mostly matters: one iteration gives something else.
            let linearised =
                flat(&one_step(candidate, &model, &state, h, newton(1, 0.5, 1e-13)).velocities);
            let error: Vec<f64> = linearised.iter().zip(&expected).map(|(a, b)| a - b).collect();
            differ += u32::from(largest(&error) > 1e-3 * largest(&expected));
        }
    }
    assert!(differ >= 8, "only {differ} cases are not linear");
}

fn one_step(
    candidate: &Candidate,
    model: &Arc<Model>,
    state: &State,
    h: f64,
    integrator: Integrator,
) -> State {
    let mut solver = solver_of(candidate, model, h, integrator);
    solver.upload(state).unwrap();
    solver.advance(Frame { duration: h }).unwrap();
    solver.synchronize().unwrap();
    download(&mut *solver)
}

#[test]
fn the_residual_of_a_strongly_stretched_cloth_falls_to_the_tolerance() {
    let mut cloth =
        grid_cloth("patch", GridPatch::horizontal(12, 0.05, 0.0), material(1e-3, 100.0, 1e-3));
    // Held all around: where springs are compressed, with a matrix that leaves a part of them out,
    // convergence is slow.
    let is_border = |i: &u32| [i % 12, i / 12].iter().any(|&k| k == 0 || k == 11);
    cloth.pins = (0..144).filter(is_border).collect();
    let model = build(ModelBuilder::new().cloth(cloth));
    let mut state = model.initial_state();
    let mut random = Random::new(32);
    for x in &mut state.positions {
        let shift = random.vector(0.02);
        *x = std::array::from_fn(|k| 1.6 * x[k] + shift[k]);
    }
    for candidate in candidates_with(Feature::Implicit) {
        // The tolerance is relative to the first residual, of which there is less and less as the
        // cloth comes to rest: single precision is asked for what it can give while it moves.
        let tolerance = if candidate.precision == Precision::F32 { 1e-2 } else { 1e-8 };
        let mut solver = solver_of(
            candidate,
            &model,
            1.0 / 60.0,
            newton(60, tolerance, 1e-5_f64.min(tolerance)),
        );
        solver.upload(&candidate.rounded(&state)).unwrap();
        let mut iterations = 0;
        for _ in 0..3 {
            solver.advance(Frame::per_second(60.0)).unwrap();
            let report = solver.synchronize().unwrap().solver;
            assert!(
                report.newton_residual <= tolerance,
                "{}: residual {:e} after {} iterations",
                candidate.label,
                report.newton_residual,
                report.newton_iterations
            );
            iterations += report.newton_iterations;
        }
        assert!(iterations > 3, "{}: only {iterations}: the case is too easy", candidate.label);
    }
}
