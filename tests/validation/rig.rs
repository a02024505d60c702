//! Small test rigs: a particle, a chain, a patch; running them.

use std::sync::Arc;

use cloth_core::{
    Cloth, Frame, Geometry, ImplicitSettings, Integrator, Model, ModelBuilder, NetworkSpring,
    Precision, Solver, SolverConfig, SpringClass, SpringNetwork, State,
};
use harness::{
    backends::{Candidate, candidates},
    feature::Feature,
    models::material,
};

/// Standard gravity of [`ModelBuilder::new`] \[m/s^2\].
pub(crate) const GRAVITY: f64 = 9.81;

/// Thickness of the cloths of these rigs \[m\].
pub(crate) const THICKNESS: f64 = 2e-3;

/// Particles without springs.
pub(crate) fn particles(positions: &[[f64; 3]], velocity: [f64; 3]) -> Cloth {
    network("particles", positions.to_vec(), Vec::new(), 1.0, 1.0, velocity)
}

/// Particles in a row, each joined to the next by a spring of the given rest length \[m\].
pub(crate) fn chain(
    positions: Vec<[f64; 3]>,
    rest_lengths: &[f64],
    mass: f64,
    stiffness: f64,
) -> Cloth {
    let springs = rest_lengths.iter().zip(0..).map(|(&rest_length, i)| NetworkSpring {
        particles: [i, i + 1],
        class: SpringClass::Stretch,
        rest_length: Some(rest_length),
        coefficients: None,
    });
    network("chain", positions, springs.collect(), mass, stiffness, [0.0; 3])
}

fn network(
    name: &str,
    positions: Vec<[f64; 3]>,
    springs: Vec<NetworkSpring>,
    mass: f64,
    stiffness: f64,
    velocity: [f64; 3],
) -> Cloth {
    Cloth {
        name: name.into(),
        geometry: Geometry::Network(SpringNetwork { positions, springs }),
        material: material(mass, stiffness, THICKNESS).into(),
        pins: Vec::new(),
        velocity,
    }
}

/// Builds a model that is known to be valid.
pub(crate) fn build(builder: ModelBuilder) -> Arc<Model> {
    match builder.build() {
        Ok(model) => Arc::new(model),
        Err(error) => panic!("the rig is not valid: {error}"),
    }
}

/// A solver with explicit steps of `time_step` \[s\].
pub(crate) fn solver(candidate: &Candidate, model: &Arc<Model>, time_step: f64) -> Box<dyn Solver> {
    solver_of(candidate, model, time_step, Integrator::Explicit)
}

/// A solver with steps of `time_step` \[s\] of an integrator.
pub(crate) fn solver_of(
    candidate: &Candidate,
    model: &Arc<Model>,
    time_step: f64,
    integrator: Integrator,
) -> Box<dyn Solver> {
    let config = SolverConfig {
        precision: candidate.precision,
        time_step,
        integrator,
        ..SolverConfig::default()
    };
    candidate.backend.create_solver(model.clone(), &config).unwrap()
}

/// The implicit integrator with linear systems solved to `tolerance`, or as far as rounding lets
/// them: single precision does not get below some 1e-6.
pub(crate) fn implicit(candidate: &Candidate, tolerance: f64) -> Integrator {
    let mut settings = ImplicitSettings::default();
    settings.linear.tolerance = tolerance.max(20.0 * candidate.epsilon());
    settings.linear.iterations_max = 2000;
    Integrator::Implicit(settings)
}

/// The integrators that solve the equations of motion themselves, so that mechanics applies to what
/// they compute, as far as the candidate offers them; linear systems solved as well as the precision allows.
pub(crate) fn integrators(candidate: &Candidate) -> Vec<Integrator> {
    let mut all = vec![Integrator::Explicit];
    if candidate.offers(Feature::Implicit) {
        all.push(implicit(candidate, 1e-12));
    }
    all
}

/// Advances by one frame of `substeps` substeps of `time_step` \[s\] and downloads the state.
pub(crate) fn advance(solver: &mut dyn Solver, substeps: u32, time_step: f64) -> State {
    solver.advance(Frame { duration: f64::from(substeps) * time_step }).unwrap();
    assert_eq!(solver.synchronize().unwrap().substeps, substeps);
    download(solver)
}

/// The present state.
pub(crate) fn download(solver: &mut dyn Solver) -> State {
    let mut state = State::default();
    solver.download(&mut state).unwrap();
    state
}

/// The candidates that compute in double precision.
pub(crate) fn in_double() -> impl Iterator<Item = &'static Candidate> {
    candidates().iter().filter(|candidate| candidate.precision == Precision::F64)
}

/// Asserts that `found` is within `relative` of `expected`.
#[track_caller]
pub(crate) fn assert_close(what: &str, found: f64, expected: f64, relative: f64) {
    let error = (found / expected - 1.0).abs();
    assert!(error <= relative, "{what}: {found}, expected {expected}, relative error {error:e}");
}
