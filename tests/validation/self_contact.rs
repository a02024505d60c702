//! Cloths that meet each other.

use std::sync::Arc;

use cloth_core::{
    ContactResponse, Frame, GridPatch, Model, ModelBuilder, SelfContact, Solver, State,
};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates},
    models::{grid_cloth, material},
};

use crate::rig::{build, download, solver};

const SPACING: f64 = 0.015;
const DISTANCE: f64 = 0.02;
const TIME_STEP: f64 = 5e-4;
const MASS: f64 = 1e-3;
const IMPULSE: ContactResponse = ContactResponse::Impulse { restitution: 0.2, friction: 0.3 };
const PENALTY: ContactResponse = ContactResponse::Penalty { stiffness: 200.0, damping: 0.05 };

/// A patch, shifted by a fraction of a cell, so that it does not lie particle on particle.
fn patch(side: u32, height: f64, shift: f64) -> GridPatch {
    let mut patch = GridPatch::horizontal(side, SPACING, height);
    patch.origin[0] += shift * SPACING;
    patch.origin[1] += 0.7 * shift * SPACING;
    patch
}

/// Two patches that fly at each other without gravity.
fn collision(response: ContactResponse) -> Arc<Model> {
    let springs = material(MASS, 30.0, 1e-3);
    let mut low = grid_cloth("low", patch(9, 0.0, 0.0), springs);
    low.velocity = [0.1, 0.0, 0.5];
    let mut high = grid_cloth("high", patch(7, 2.0 * DISTANCE, 0.4), springs);
    high.velocity = [0.0, -0.2, -0.8];
    let contact = SelfContact { distance: DISTANCE, response };
    build(ModelBuilder::new().gravity([0.0; 3]).cloth(low).cloth(high).self_contact(contact))
}

fn momentum(model: &Model, state: &State) -> DVec3 {
    let momenta = model.masses().iter().zip(&state.velocities);
    momenta.map(|(&mass, &velocity)| mass * DVec3::from(velocity)).sum()
}

/// Runs a tenth of a second; the largest number of contacts seen.
fn run(solver: &mut dyn Solver) -> u64 {
    let frames = (0..100).map(|_| {
        solver.advance(Frame { duration: 2.0 * TIME_STEP }).unwrap();
        solver.synchronize().unwrap().contacts
    });
    frames.max().unwrap_or(0)
}

/// Contact forces and impulses are equal and opposite: a collision changes the momentum of each
/// cloth, but not that of both.
#[test]
fn a_collision_of_two_cloths_conserves_momentum() {
    for response in [IMPULSE, PENALTY] {
        let model = collision(response);
        let start = momentum(&model, &model.initial_state());
        for candidate in candidates() {
            let mut solver = solver(candidate, &model, TIME_STEP);
            assert!(run(&mut *solver) > 20, "{}: they did not meet", candidate.label);
            let state = download(&mut *solver);
            let change = (momentum(&model, &state) - start).length();
            // Each of 200 substeps rounds, for each of the particles, a sum of a dozen forces of up
            // to k L: h 24 eps k L, and a velocity of about 1 m/s.
            let per_step = TIME_STEP * 24.0 * 30.0 * SPACING + MASS;
            let tolerance = 200.0 * model.particle_count() as f64 * per_step * candidate.epsilon();
            assert!(change <= tolerance, "{}: {change:e} of {tolerance:e}", candidate.label);
            let low = State { velocities: state.velocities[..81].to_vec(), ..State::default() };
            let exchanged = (momentum(&model, &low).z - 81.0 * MASS * 0.5).abs();
            assert!(exchanged > 0.01, "{}: nothing was exchanged", candidate.label);
        }
    }
}

/// Two cloths whose spacing is below the contact distance, moving less than it in a substep, cannot
/// pass through each other.
#[test]
fn cloths_do_not_pass_through_each_other() {
    for response in [IMPULSE, PENALTY] {
        let springs = material(MASS, 100.0, 1e-3);
        let side = 11;
        let mut low = grid_cloth("low", patch(side, 0.0, 0.0), springs);
        let is_border = |i: &u32| [i % side, i / side].iter().any(|&k| k == 0 || k == side - 1);
        low.pins = (0..side * side).filter(is_border).collect();
        let mut high = grid_cloth("high", patch(7, 2.0 * DISTANCE, 0.4), springs);
        high.velocity = [0.0, 0.0, -1.0];
        let contact = SelfContact { distance: DISTANCE, response };
        let model = build(ModelBuilder::new().cloth(low).cloth(high).self_contact(contact));
        for candidate in candidates() {
            let mut solver = solver(candidate, &model, TIME_STEP);
            for _ in 0..3 {
                run(&mut *solver);
                assert_separated(
                    candidate,
                    response,
                    &download(&mut *solver),
                    (side * side) as usize,
                );
            }
        }
    }
}

/// Every particle of the cloth above is above all those of the one below that are near it.
fn assert_separated(candidate: &Candidate, response: ContactResponse, state: &State, split: usize) {
    let [low, high] = [&state.positions[..split], &state.positions[split..]];
    for (i, a) in high.iter().enumerate() {
        for b in low {
            let is_near = (a[0] - b[0]).hypot(a[1] - b[1]) < 0.5 * SPACING;
            assert!(
                !is_near || a[2] > b[2],
                "{} with {response:?}: particle {i} passed through at {a:?}",
                candidate.label
            );
        }
    }
}
