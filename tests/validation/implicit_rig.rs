//! Linear systems of small random models, for tests of the implicit integrator.

use std::sync::Arc;

use cloth_core::{
    Cloth, Geometry, ImplicitSettings, Integrator, Kernels, LinearVector, MatrixBlock, Model,
    ModelBuilder, NetworkSpring, NewtonStart, Pose, SolverConfig, SpringClass, SpringCoefficients,
    SpringNetwork, State,
    stepper::{FramePlan, FrameSpan, Substep},
};
use harness::{backends::Candidate, models::material, random::Random};

use crate::rig::build;

/// What a random state is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Stretched,
    Compressed,
    /// Some springs of almost or exactly no length.
    Coinciding,
}

impl Shape {
    pub(crate) const ALL: [Self; 3] = [Self::Stretched, Self::Compressed, Self::Coinciding];
}

/// Particles joined at random, springs with dampers.
pub(crate) fn network(particles: u32, random: &mut Random) -> Cloth {
    let mut springs = Vec::new();
    for i in 0..particles {
        for j in i + 1..particles {
            if j == i + 1 || random.chance(0.4) {
                springs.push(NetworkSpring {
                    particles: [i, j],
                    class: SpringClass::Stretch,
                    rest_length: Some(random.between(0.05, 0.2)),
                    coefficients: None,
                });
            }
        }
    }
    let mut fabric = material(random.logarithmic(1e-4, 1e-2), 1.0, 2e-3);
    fabric.stretch = SpringCoefficients {
        stiffness: random.logarithmic(1.0, 1e4),
        damping: if random.chance(0.5) { random.logarithmic(1e-4, 1.0) } else { 0.0 },
    };
    let positions = (0..particles).map(|_| random.vector(0.1)).collect();
    Cloth {
        name: "network".into(),
        geometry: Geometry::Network(SpringNetwork { positions, springs }),
        material: fabric.into(),
        pins: Vec::new(),
        velocity: [0.0; 3],
    }
}

/// A model of one random network.
pub(crate) fn network_model(particles: u32, random: &mut Random) -> Arc<Model> {
    build(ModelBuilder::new().cloth(network(particles, random)))
}

/// A random state of a model.
pub(crate) fn random_state(model: &Model, shape: Shape, random: &mut Random) -> State {
    let mut state = model.initial_state();
    let size = match shape {
        Shape::Stretched => 0.6,
        Shape::Compressed => 0.04,
        Shape::Coinciding => 0.2,
    };
    for i in 0..state.len() {
        state.positions[i] = random.vector(size);
        state.velocities[i] = random.vector(2.0);
        if shape == Shape::Coinciding && i % 3 == 1 {
            let offset = if random.chance(0.3) { 0.0 } else { random.logarithmic(1e-12, 1e-3) };
            let direction = random.direction();
            let other = state.positions[i - 1];
            state.positions[i] = std::array::from_fn(|k| other[k] + offset * direction[k]);
        }
    }
    state
}

/// Kernels at the start of a substep of this length \[s\], colliders where they are.
pub(crate) fn kernels(
    candidate: &Candidate,
    model: &Arc<Model>,
    state: &State,
    length: f64,
) -> (Box<dyn Kernels>, Substep) {
    kernels_moving(candidate, model, state, &state.colliders, length)
}

/// The same with colliders that are at `targets` when the substep ends.
pub(crate) fn kernels_moving(
    candidate: &Candidate,
    model: &Arc<Model>,
    state: &State,
    targets: &[Pose],
    length: f64,
) -> (Box<dyn Kernels>, Substep) {
    let config = SolverConfig {
        precision: candidate.precision,
        time_step: length,
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        ..SolverConfig::default()
    };
    let mut kernels = candidate.backend.create_kernels(model.clone(), &config).unwrap();
    let mut plan = FramePlan::default();
    let span = FrameSpan {
        time: 0.0,
        duration: length,
        wind_velocity: model.air().map_or([0.0; 3], |air| air.wind_velocity),
        anchor_offset: [[0.0; 3]; 2],
        from: &state.colliders,
        to: targets,
    };
    plan.refill(model, &span, (0.0, 0), length);
    kernels.state_write(state).unwrap();
    kernels.frame_begin(&plan).unwrap();
    (kernels, plan.substeps[0])
}

/// Runs the stages up to the system.
pub(crate) fn assemble(kernels: &mut dyn Kernels, substep: &Substep) {
    kernels.state_keep().unwrap();
    kernels.field_forces().unwrap();
    if kernels.model().air().is_some() {
        kernels.aerodynamic_forces(substep).unwrap();
    }
    kernels.spring_linearise(substep).unwrap();
    if kernels.contact_is_penalty() {
        kernels.contact_candidates().unwrap();
        kernels.contact_forces().unwrap();
        kernels.contact_linearise(substep).unwrap();
    }
    kernels.implicit_assemble(substep, NewtonStart::StepStart).unwrap();
}

/// The matrix.
pub(crate) fn matrix(kernels: &mut dyn Kernels) -> Vec<MatrixBlock> {
    let mut blocks = Vec::new();
    kernels.matrix_read(&mut blocks).unwrap();
    blocks
}

/// A vector.
pub(crate) fn vector(kernels: &mut dyn Kernels, which: LinearVector) -> Vec<[f64; 3]> {
    let mut values = Vec::new();
    kernels.vector_read(which, &mut values).unwrap();
    values
}
