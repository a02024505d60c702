//! Hanging chains.

use std::{f64::consts::PI, sync::Arc};

use cloth_core::{Field, Integrator, Model, ModelBuilder, State};
use harness::{
    backends::{Candidate, candidates_with, reference},
    feature::Feature,
};

use crate::rig::{GRAVITY, advance, assert_close, build, chain, implicit, solver_of};

/// Bessel function of the first kind and order zero, by its power series; for moderate `x`.
fn bessel_j0(x: f64) -> f64 {
    let quarter = x * x / 4.0;
    let mut term = 1.0;
    let mut sum = term;
    for k in 1..60 {
        term *= -quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

/// Frequency [rad/s] of small oscillations, started at rest in the shape of the mode with this zero
/// of the Bessel function, found from the first times at which the mode passes zero.
fn mode_frequency(candidate: &Candidate, zero: f64, integrator: Integrator) -> f64 {
    let links = 60_usize;
    let spacing = 1.0 / links as f64;
    let mass = 1e-3;
    // Stretches by no more than a thousandth; the rest lengths allow for even that.
    let weight = |below: usize| below as f64 * mass * GRAVITY;
    let stiffness = 1000.0 * weight(links) / spacing;
    // Particles in the middle of their links: the tension between two of them is then exactly that
    // of the continuous chain.
    let depth = |i: usize| if i == 0 { 0.0 } else { (i as f64 - 0.5) * spacing };
    let shape = |i: usize| bessel_j0(zero * (1.0 - depth(i)).sqrt());
    let positions: Vec<_> = (0..=links).map(|i| [0.0, 0.0, -depth(i)]).collect();
    let rest_lengths: Vec<_> =
        (0..links).map(|i| depth(i + 1) - depth(i) - weight(links - i) / stiffness).collect();
    let mut cloth = chain(positions, &rest_lengths, mass, stiffness);
    cloth.pins = vec![0];
    let model = build(ModelBuilder::new().cloth(cloth));
    let mut state = model.initial_state();
    for i in 1..=links {
        state.positions[i][0] = 1e-3 * shape(i);
    }
    // Backward Euler turns the phase by atan(w h) instead of w h in a step: 1e-4 less here.
    let (frame_substeps, time_step) = match integrator {
        Integrator::Explicit => (20, 0.5 * model.stable_time_step()),
        _ => (1, 1e-3),
    };
    let mut solver = solver_of(candidate, &model, time_step, integrator);
    solver.upload(&state).unwrap();
    let mut crossings = Vec::new();
    let [mut time, mut before] = [0.0, f64::NAN];
    while crossings.len() < 3 {
        let positions = advance(&mut *solver, frame_substeps, time_step).positions;
        let frame = f64::from(frame_substeps) * time_step;
        let now: f64 = (1..=links).map(|i| shape(i) * positions[i][0]).sum();
        if before * now < 0.0 {
            crossings.push(time + frame * before / (before - now));
        }
        time += frame;
        before = now;
        assert!(time < 10.0, "the chain does not swing");
    }
    PI / ((crossings[2] - crossings[0]) / 2.0)
}

/// Daniel Bernoulli (1733): the modes of a hanging chain of length L are J0(z_k sqrt(s/L)), s the
/// height above the free end, with frequencies z_k/2 sqrt(g/L), z_k the zeros of J0 (Lamb 1910, "The
/// Dynamical Theory of Sound", section 36).
#[test]
fn a_hanging_chain_swings_with_the_frequencies_of_bernoulli() {
    let zeros = [2.404_825_557_695_773, 5.520_078_110_286_311, 8.653_727_912_911_013];
    for (zero, expected) in zeros.into_iter().zip([1.2024, 2.7600, 4.3269]) {
        for integrator in [Integrator::Explicit, implicit(reference(), 1e-9)] {
            let found = mode_frequency(reference(), zero, integrator) / GRAVITY.sqrt();
            assert_close("omega sqrt(L/g)", found, expected, 0.01);
        }
    }
}

/// Links of [`catenary`].
pub(crate) const CATENARY_LINKS: usize = 60;

/// Leibniz, Huygens and Johann Bernoulli (1691): a chain of length 2 a sinh(b/2a) across a span b
/// sags by a (cosh(b/2a) - 1): so many metres for one of 1.5 m across 1 m.
pub(crate) const CATENARY_SAG: f64 = 0.50263;

/// That chain in air with a drag rate \[1/s\], at the start two straight lines; a spring bears `stiffness` times its
/// weight at a strain of one.
pub(crate) fn catenary(stiffness: f64, drag_rate: f64) -> Arc<Model> {
    let links = CATENARY_LINKS;
    let [span, length] = [1.0, 1.5];
    let mass = 1e-3;
    let spacing = length / links as f64;
    let stiffness = stiffness * links as f64 * mass * GRAVITY / spacing;
    let depth = (length * length - span * span).sqrt() / 2.0;
    let positions: Vec<_> = (0..=links)
        .map(|i| {
            let fraction = i as f64 / links as f64;
            [span * fraction, 0.0, -depth * (1.0 - (2.0 * fraction - 1.0).abs())]
        })
        .collect();
    let mut cloth = chain(positions, &vec![spacing; links], mass, stiffness);
    cloth.pins = vec![0, links as u32];
    let drag = Field::Drag { rate: [drag_rate; 3] };
    build(ModelBuilder::new().field(drag).cloth(cloth))
}

#[test]
fn a_chain_between_two_points_hangs_in_the_catenary() {
    let model = catenary(5000.0, 8.0);
    let sag = |state: &State| -state.positions[CATENARY_LINKS / 2][2];
    for candidate in candidates_with(Feature::Implicit) {
        if candidate.case_divisor > 1 {
            continue; // It would take long to come to rest; frames of it are compared elsewhere.
        }
        let explicit = (Integrator::Explicit, 0.8 * model.stable_time_step(), 1000);
        let large_steps = (implicit(candidate, 1e-6), 0.01, 10);
        for (integrator, time_step, substeps) in [explicit, large_steps] {
            let mut solver = solver_of(candidate, &model, time_step, integrator);
            // The slowest mode decays with half the drag rate: e^-10 after 2.5 seconds.
            let mut state = model.initial_state();
            while state.time < 2.5 {
                state = advance(&mut *solver, substeps, time_step);
            }
            assert_close("sag", sag(&state), CATENARY_SAG, 0.005);
        }
    }
}
