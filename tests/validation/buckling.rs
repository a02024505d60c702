//! Struts that buckle (Choi and Ko 2002), against the arc that they are.

use std::sync::Arc;

use cloth_core::{
    BendModel, Cloth, Frame, Geometry, Model, ModelBuilder, NetworkSpring, SpringClass,
    SpringNetwork, State,
};
use harness::{
    backends::{Candidate, candidates},
    models::material,
    stages::spring_tension,
    tracked::Tracked,
};

use crate::rig::{THICKNESS, assert_close, build, in_double, solver};

const REST_LENGTH: f64 = 0.2;
const RIGIDITY: f64 = 3e-5;
const MASS: f64 = 0.01;
/// L^3 k / B: the strut buckles at a compression of 1.2 %.
const STIFFNESS: f64 = 1000.0 * RIGIDITY / (REST_LENGTH * REST_LENGTH * REST_LENGTH);
/// Relative error of the polynomial as NUMERICS states it.
const POLYNOMIAL_ERROR: f64 = 3.45e-3;

/// Two particles at a distance of `length` \[m\], joined by a strut.
fn strut(length: f64, damping: f64) -> Arc<Model> {
    let mut fabric = material(MASS, STIFFNESS, THICKNESS);
    fabric.bend.damping = damping;
    fabric.bend_model = BendModel::ImmediateBuckling { rigidity: RIGIDITY };
    let spring = NetworkSpring {
        particles: [0, 1],
        class: SpringClass::Bend,
        rest_length: Some(REST_LENGTH),
        coefficients: None,
    };
    let network =
        SpringNetwork { positions: vec![[0.0; 3], [0.0, 0.0, length]], springs: vec![spring] };
    build(ModelBuilder::new().gravity([0.0; 3]).cloth(Cloth {
        name: "strut".into(),
        geometry: Geometry::Network(network),
        material: fabric.into(),
        pins: Vec::new(),
        velocity: [0.0; 3],
    }))
}

/// Half the angle y that an arc subtends whose chord is `ratio` of its length: sin y / y.
fn arc_half_angle(ratio: f64) -> f64 {
    let [mut low, mut high] = [0.0, std::f64::consts::PI];
    for _ in 0..100 {
        let middle: f64 = 0.5 * (low + high);
        if middle.sin() / middle > ratio { low = middle } else { high = middle }
    }
    low
}

/// Energy of the arc \[J\]: B / 2 times the square of its curvature, times its length.
fn arc_energy(ratio: f64) -> f64 {
    let curvature = 2.0 * arc_half_angle(ratio) / REST_LENGTH;
    0.5 * RIGIDITY * curvature * curvature * REST_LENGTH
}

/// The tension of the arc \[N\] in closed form.
fn arc_tension(ratio: f64) -> f64 {
    let half_angle = arc_half_angle(ratio);
    let curvature = 2.0 * half_angle / REST_LENGTH;
    RIGIDITY * curvature * curvature / (half_angle.cos() - ratio)
}

/// The tension that a backend computes for a strut compressed to `ratio` \[N\].
fn tension(candidate: &Candidate, ratio: f64) -> f64 {
    let model = strut(ratio * REST_LENGTH, 0.0);
    let config = cloth_core::SolverConfig {
        precision: candidate.precision,
        ..cloth_core::SolverConfig::default()
    };
    let mut kernels = candidate.backend.create_kernels(model, &config).unwrap();
    kernels.field_forces().unwrap();
    kernels.spring_forces().unwrap();
    let mut forces = Vec::new();
    kernels.forces_read(&mut forces).unwrap();
    assert_eq!(forces[0], forces[1].map(|component| -component));
    forces[0][2]
}

#[test]
fn the_closed_form_of_the_arc_is_the_derivative_of_its_energy() {
    for ratio in [0.95, 0.6, 0.2] {
        let step = 1e-5;
        let difference = (arc_energy(ratio + step) - arc_energy(ratio - step)) / (2.0 * step);
        assert_close("tension", arc_tension(ratio), difference / REST_LENGTH, 1e-7);
    }
}

#[test]
fn a_compressed_strut_pushes_like_an_arc() {
    for candidate in candidates() {
        for ratio in [0.98, 0.95, 0.8, 0.6, 0.4, 0.2, 0.01] {
            let rounding = 100.0 * candidate.epsilon();
            let expected = arc_tension(ratio);
            let found = tension(candidate, ratio);
            let what = format!("{}: tension at {ratio}", candidate.label);
            assert_close(&what, found, expected, POLYNOMIAL_ERROR + rounding);
            // Were it not for its buckling, it would push as hard as its stiffness makes it.
            assert!(found > 0.7 * STIFFNESS * REST_LENGTH * (ratio - 1.0), "{what}: {found}");
        }
    }
}

#[test]
fn on_the_ramp_and_under_tension_it_is_a_spring() {
    let kind = strut(REST_LENGTH, 0.0).springs().kinds()[0];
    let onset = kind.buckling_onset().unwrap();
    assert_close("onset", onset, 12.0 * RIGIDITY / (STIFFNESS * REST_LENGTH.powi(3)), 0.01);
    for candidate in candidates() {
        for ratio in [1.0 - 0.99 * onset, 1.0 - 0.5 * onset, 1.0 + onset, 1.5, 3.0] {
            let expected = STIFFNESS * REST_LENGTH * (ratio - 1.0);
            let what = format!("{}: tension at {ratio}", candidate.label);
            // Rounding of l - L, where l is a hundred times as long.
            assert_close(&what, tension(candidate, ratio), expected, 1e3 * candidate.epsilon());
        }
        let beyond = tension(candidate, 1.0 - 1.01 * onset);
        assert!(beyond > -STIFFNESS * REST_LENGTH * 1.009 * onset, "{}", candidate.label);
    }
}

#[test]
fn the_derivative_is_that_of_the_tension() {
    let kind = strut(REST_LENGTH, 0.0).springs().kinds()[0];
    let buckling = kind.buckling().unwrap();
    let step = 1e-5 * REST_LENGTH;
    for ratio in [0.1, 0.3, 0.6, 0.9, 0.98, 0.995, 1.5] {
        let length = ratio * REST_LENGTH;
        let [low, high] = [length - step, length + step]
            .map(|l| spring_tension(&kind, Tracked::exact(l), f64::EPSILON).value);
        let found = buckling.tension_derivative(STIFFNESS, length - REST_LENGTH);
        assert_close("derivative", found, (high - low) / (2.0 * step), 1e-6);
        let single = buckling.rounded::<f32>();
        let found = single.tension_derivative(STIFFNESS as f32, (length - REST_LENGTH) as f32);
        assert_close("derivative in f32", f64::from(found), (high - low) / (2.0 * step), 1e-4);
    }
}

/// Total energy \[J\] and length \[m\] after each of `frames` frames of ten substeps.
fn oscillation(
    candidate: &Candidate,
    model: &Arc<Model>,
    time_step: f64,
    frames: usize,
) -> Vec<[f64; 2]> {
    let mut solver = solver(candidate, model, time_step);
    let mut state = State::default();
    (0..frames)
        .map(|_| {
            solver.advance(Frame { duration: 10.0 * time_step }).unwrap();
            let energy = solver.synchronize().unwrap().measures.energy();
            solver.download(&mut state).unwrap();
            [energy, state.positions[1][2] - state.positions[0][2]]
        })
        .collect()
}

#[test]
fn an_oscillating_strut_conserves_its_energy() {
    // It starts at rest at 60 % of its length and swings through both branches.
    let model = strut(0.6 * REST_LENGTH, 0.0);
    for candidate in in_double() {
        let config = cloth_core::SolverConfig {
            precision: candidate.precision,
            ..cloth_core::SolverConfig::default()
        };
        let at_rest = candidate.backend.create_kernels(model.clone(), &config);
        let start = at_rest.unwrap().measure().unwrap().energy();
        // The ramp adds half of what the arc would need up to the onset, and takes as much away.
        assert_close("energy", start, arc_energy(0.6), 0.02);
        let deviations = [0.02, 0.01].map(|share| {
            let time_step = share * model.stable_time_step();
            let found = oscillation(candidate, &model, time_step, (60.0 / share) as usize);
            let [shortest, longest] = found
                .iter()
                .fold([f64::MAX, 0.0], |[a, b], &[_, length]| [length.min(a), length.max(b)]);
            // Both turning points have this energy: the other one is that of the linear spring.
            let expected = REST_LENGTH + (2.0 * start / STIFFNESS).sqrt();
            assert_close("longest", longest, expected, 0.01);
            assert_close("shortest", shortest, 0.6 * REST_LENGTH, 0.01);
            found.iter().map(|[energy, _]| (energy / start - 1.0).abs()).fold(0.0, f64::max)
        });
        // Of first order, omega h / 2 for a linear spring, and without drift over all the periods.
        assert!(deviations[0] < 1.1 * 0.02, "relative deviation {deviations:?}");
        assert!(deviations[1] < 1.1 * 0.01, "relative deviation {deviations:?}");
    }
}

#[test]
fn a_damper_acts_on_a_buckled_strut_as_on_any() {
    let damping = 0.05;
    let model = strut(0.6 * REST_LENGTH, damping);
    let mut state = model.initial_state();
    state.velocities[1] = [0.0, 0.0, -2.0];
    for candidate in in_double() {
        let config = cloth_core::SolverConfig::default();
        let config = cloth_core::SolverConfig { precision: candidate.precision, ..config };
        let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
        kernels.state_write(&state).unwrap();
        kernels.field_forces().unwrap();
        kernels.spring_forces().unwrap();
        let mut forces = Vec::new();
        kernels.forces_read(&mut forces).unwrap();
        let expected = tension(candidate, 0.6) - 2.0 * damping;
        assert_close("force", forces[0][2], expected, 1e-14);
    }
}

/// The time step of the model is stable wherever on its tension curve the strut is: nearly too rigid
/// struts are steeper than their stiffness at high compression.
#[test]
fn the_stability_limit_knows_the_steepest_part() {
    let kind = strut(REST_LENGTH, 0.0).springs().kinds()[0];
    assert_eq!(kind.stiffness_max(), STIFFNESS);
    let rigid = cloth_core::SpringKind { rigidity: Some(30.0 * RIGIDITY), ..kind };
    let buckling = rigid.buckling().unwrap();
    let steepest = (0..=1000)
        .map(|i| f64::from(i) * 1e-3 * REST_LENGTH - REST_LENGTH)
        .map(|stretch| buckling.tension_derivative(STIFFNESS, stretch))
        .fold(0.0, f64::max);
    assert!(steepest > STIFFNESS * 1.5, "{steepest}");
    assert_close("steepest", rigid.stiffness_max(), steepest, 0.01);
}
