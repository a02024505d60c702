//! The midpoint integrator: what it keeps, and what it damps.

use std::sync::Arc;

use cloth_core::{
    Cloth, Frame, Geometry, GridPatch, ImplicitSettings, Integrator, MidpointSettings, Model,
    ModelBuilder, NetworkSpring, Precision, SolverConfig, SpringClass, SpringNetwork, State,
};
use glam::DVec3;
use harness::{
    backends::{Candidate, candidates, candidates_with},
    feature::Feature,
    models::{grid_cloth, material},
};

use crate::rig::build;

/// Length of a substep \[s\].
const STEP: f64 = 1.0 / 60.0;

/// Runs a model from a state for some seconds.
fn run(
    candidate: &Candidate,
    model: &Arc<Model>,
    state: &State,
    integrator: Integrator,
    steps: u32,
    mut look: impl FnMut(&State),
) {
    let config = SolverConfig {
        precision: candidate.precision,
        time_step: STEP,
        integrator,
        ..SolverConfig::default()
    };
    let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
    solver.upload(state).unwrap();
    let mut state = State::default();
    for _ in 0..steps {
        solver.advance(Frame { duration: STEP }).unwrap();
        solver.synchronize().unwrap();
        solver.download(&mut state).unwrap();
        look(&state);
    }
}

fn midpoint() -> MidpointSettings {
    let mut settings = MidpointSettings::default();
    settings.linear.tolerance = 1e-5;
    settings.linear.iterations_max = 1000;
    settings
}

/// About the centre of mass \[kg m^2/s\].
fn angular_momentum(model: &Model, state: &State) -> DVec3 {
    let all = || model.masses().iter().zip(state.positions.iter().zip(&state.velocities));
    let mass: f64 = model.masses().iter().sum();
    let centre = all().map(|(&m, (&x, _))| m * DVec3::from(x)).sum::<DVec3>() / mass;
    all().map(|(&m, (&x, &v))| m * (DVec3::from(x) - centre).cross(v.into())).sum()
}

/// A stiff patch of springs that turns about a slanted axis.
fn spinning() -> (Arc<Model>, State) {
    let patch = GridPatch::horizontal(9, 0.05, 0.0);
    let cloth = grid_cloth("patch", patch, material(2e-3, 200.0, 1e-3));
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
    let mut state = model.initial_state();
    for (x, v) in state.positions.iter().zip(&mut state.velocities) {
        *v = DVec3::new(0.0, 1.0, 4.0).cross((*x).into()).into();
    }
    (model, state)
}

/// The share of angular momentum that is left after five seconds.
fn spin_left(candidate: &Candidate, integrator: Integrator) -> f64 {
    let (model, state) = spinning();
    let state = candidate.rounded(&state);
    let before = angular_momentum(&model, &state);
    let mut after = DVec3::ZERO;
    run(candidate, &model, &state, integrator, 300, |state| {
        after = angular_momentum(&model, state);
    });
    after.dot(before) / before.length_squared()
}

#[test]
fn a_cloth_that_turns_freely_keeps_its_spin() {
    for candidate in candidates_with(Feature::SemiImplicit) {
        let left = spin_left(candidate, Integrator::Midpoint(midpoint()));
        let bound = if candidate.precision == Precision::F64 { 1e-9 } else { 1e-3 };
        assert!((left - 1.0).abs() < bound, "{}: {left}", candidate.label);
    }
    // The implicit one shows that there is something to lose.
    let candidate = &candidates()[0];
    let left = spin_left(candidate, Integrator::Implicit(ImplicitSettings::default()));
    assert!(left < 0.5, "{left}");
}

/// A particle on a spring has the matrix of the scheme exactly: in the direction of the spring x'' = -w^2 x turns with
/// the factor of |z|^2 = ((1 + (1 - a)^2 s) / (1 + a^2 s)), s = (w h)^2, a the weight, in each step.
#[test]
fn an_oscillation_is_damped_as_the_scheme_says() {
    for (stiffness, weight) in [(1.0, 0.6), (1e4, 0.6), (1e4, 0.75), (10.0, 1.0)] {
        let mass = 2e-3;
        let springs = vec![NetworkSpring {
            particles: [0, 1],
            class: SpringClass::Stretch,
            rest_length: Some(1.0),
            coefficients: None,
        }];
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0]];
        let cloth = Cloth {
            name: "spring".into(),
            geometry: Geometry::Network(SpringNetwork { positions, springs }),
            material: material(mass, stiffness, 1e-3).into(),
            pins: vec![0],
            velocity: [0.0; 3],
        };
        let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
        let mass = model.masses()[1];
        let mut state = model.initial_state();
        state.positions[1][0] += 1e-3;
        let squared = stiffness / mass;
        // m v^2 / 2 + k x^2 / 2 is a multiple of |z|^2.
        let energy = |state: &State| {
            let [x, v] = [state.positions[1][0] - 1.0, state.velocities[1][0]];
            v * v + squared * x * x
        };
        let s = squared * STEP * STEP;
        let factor = (1.0 + (1.0 - weight) * (1.0 - weight) * s) / (1.0 + weight * weight * s);
        for candidate in candidates().iter().filter(|c| c.precision == Precision::F64) {
            let settings = MidpointSettings { weight, ..midpoint() };
            let mut expected = energy(&state);
            run(candidate, &model, &state, Integrator::Midpoint(settings), 5, |state| {
                expected *= factor;
                let found = energy(state) / expected;
                assert!(
                    (found - 1.0).abs() < 1e-3,
                    "{} {stiffness} {weight}: {found}",
                    candidate.label
                );
            });
        }
    }
}
