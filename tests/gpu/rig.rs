//! Models and devices for these tests.

use std::sync::Arc;

use cloth_backend_wgpu::{WgpuBackend, WgpuOptions, wgpu};
use cloth_core::{
    Air, Backend, Collider, ColliderShape, ContactResponse, Frame, GridPatch, ImplicitSettings,
    Integrator, Model, ModelBuilder, Pose, SelfContact, Solver, SolverConfig, State, StrainLimit,
};
use harness::models::{fold, grid_cloth, material};

/// A patch of `side` x `side` particles over a ball.
pub(crate) fn model(side: u32, contact: Option<ContactResponse>) -> Arc<Model> {
    let spacing = 0.02;
    let patch = GridPatch::horizontal(side, spacing, 0.06);
    let ball = Collider {
        name: "ball".into(),
        shape: ColliderShape::Sphere { radius: 0.1 },
        pose: Pose::from_translation([0.0, 0.0, -0.05]),
        friction: 0.3,
        restitution: 0.1,
    };
    let mut builder = ModelBuilder::new()
        .cloth(grid_cloth("cloth", patch, material(1e-4, 50.0, 2e-3)))
        .collider(ball)
        .air(Air::with_wind([1.0, 0.5, 0.0]));
    if let Some(response) = contact {
        builder = builder.self_contact(SelfContact { distance: 0.9 * spacing, response });
    }
    Arc::new(builder.build().unwrap())
}

pub(crate) const PENALTY: ContactResponse =
    ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
pub(crate) const IMPULSE: ContactResponse =
    ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };

pub(crate) fn config() -> SolverConfig {
    let strain_limit = Some(StrainLimit::default());
    SolverConfig {
        time_step: 5e-4,
        integrator: Integrator::Explicit,
        strain_limit,
        strain_bound: 1e3,
        ..SolverConfig::default()
    }
}

/// Large steps of the implicit integrator.
pub(crate) fn implicit_config() -> SolverConfig {
    SolverConfig {
        time_step: 5e-3,
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        strain_limit: None,
        ..config()
    }
}

/// The state after some frames of six substeps, from a folded start.
pub(crate) fn run(backend: &dyn Backend, model: &Arc<Model>, frames: usize) -> State {
    run_with(backend, model, &config(), frames)
}

/// The same with other settings.
pub(crate) fn run_with(
    backend: &dyn Backend,
    model: &Arc<Model>,
    config: &SolverConfig,
    frames: usize,
) -> State {
    let mut solver = backend.create_solver(Arc::clone(model), config).unwrap();
    let mut state = model.initial_state();
    fold(&mut state, 0.01, 0.025);
    solver.upload(&state).unwrap();
    for _ in 0..frames {
        solver.advance(Frame { duration: 6.0 * config.time_step }).unwrap();
        solver.synchronize().unwrap();
    }
    solver.download(&mut state).unwrap();
    state
}

pub(crate) fn advance(solver: &mut dyn Solver, frames: usize) {
    for _ in 0..frames {
        solver.advance(Frame { duration: 6.0 * 5e-4 }).unwrap();
        solver.synchronize().unwrap();
    }
}

/// The device of this machine with some of its limits lowered.
pub(crate) fn lowered(change: impl FnOnce(&mut wgpu::Limits)) -> WgpuBackend {
    let mut limits = harness::backends::gpu().device().limits();
    change(&mut limits);
    WgpuBackend::with_options(&WgpuOptions { limits: Some(limits), ..WgpuOptions::default() })
        .unwrap()
}
