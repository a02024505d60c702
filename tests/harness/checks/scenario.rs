//! A scenario with everything in it, for checks of whole simulations.

use std::sync::Arc;

use cloth_core::{
    Backend, Collider, ColliderShape, ContactResponse, Frame, GridPatch, Integrator, Model,
    ModelBuilder, Pose, Precision, SelfContact, Solver, SolverConfig, State, StrainLimit,
};

use crate::{
    models::{fold, grid_cloth, material},
    verdict::{Failure, ensure},
};

/// A folded cloth that falls on the ground, on a ball half buried in it, and on itself.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Particles along each side of the cloth.
    pub side: u32,
    /// How contact acts.
    pub response: ContactResponse,
    /// Precision.
    pub precision: Precision,
    /// Substeps in all.
    pub substeps: u32,
    /// How the state is advanced.
    pub integrator: Integrator,
    /// Whether springs are limited: without it the explicit integrator can fuse its stages.
    pub strain_limit: bool,
}

/// Substeps of a frame.
pub(super) const FRAME_SUBSTEPS: u32 = 6;
/// Length of a substep of the explicit integrator \[s\], and of those with large steps.
const TIME_STEPS: [f64; 2] = [5e-4, 0.01];
/// Distance of neighbouring particles \[m\].
const SPACING: f64 = 0.02;

impl Scenario {
    /// Length of a substep \[s\].
    const fn time_step(&self) -> f64 {
        TIME_STEPS[if matches!(self.integrator, Integrator::Explicit) { 0 } else { 1 }]
    }

    /// Length of a frame \[s\].
    pub(super) fn frame(&self) -> Frame {
        Frame { duration: f64::from(FRAME_SUBSTEPS) * self.time_step() }
    }

    pub(super) fn model(&self) -> Arc<Model> {
        let patch = GridPatch::horizontal(self.side, SPACING, 0.03);
        let collider = |name: &str, shape: ColliderShape, height: f64| Collider {
            name: name.into(),
            shape,
            pose: Pose::from_translation([0.0, 0.0, height]),
            friction: 0.3,
            restitution: 0.0,
        };
        let contact = SelfContact { distance: 0.9 * SPACING, response: self.response };
        let model = ModelBuilder::new()
            .cloth(grid_cloth("cloth", patch, material(1e-4, 50.0, 2e-3)))
            .collider(collider("ground", ColliderShape::Plane, 0.0))
            .collider(collider("ball", ColliderShape::Sphere { radius: 0.15 }, -0.13))
            .self_contact(contact)
            .build();
        match model {
            Ok(model) => Arc::new(model),
            Err(error) => panic!("the scenario is not valid: {error}"),
        }
    }

    pub(super) fn start(model: &Model) -> State {
        let mut state = model.initial_state();
        fold(&mut state, 0.1 * SPACING, 1.2 * SPACING);
        state
    }

    pub(super) fn solver(&self, backend: &dyn Backend) -> cloth_core::Result<Box<dyn Solver>> {
        let limit = self.strain_limit.then(StrainLimit::default);
        let config = SolverConfig {
            precision: self.precision,
            time_step: self.time_step(),
            integrator: self.integrator.clone(),
            strain_limit: limit,
            strain_bound: 1e3,
            ..SolverConfig::default()
        };
        backend.create_solver(self.model(), &config)
    }

    /// Advances a solver by `substeps`; the contacts at the ends of all frames together.
    pub(super) fn advance(
        &self,
        solver: &mut dyn Solver,
        substeps: u32,
    ) -> cloth_core::Result<u64> {
        let mut contacts = 0;
        for _ in 0..substeps / FRAME_SUBSTEPS {
            solver.advance(self.frame())?;
            contacts += solver.synchronize()?.contacts;
        }
        Ok(contacts)
    }

    /// The last state of a run from the start.
    pub(super) fn run(&self, backend: &dyn Backend) -> Result<State, Failure> {
        self.run_from(backend, &Self::start(&self.model()))
    }

    /// The last state of a run from any state.
    pub(super) fn run_from(&self, backend: &dyn Backend, start: &State) -> Result<State, Failure> {
        let mut solver = self.solver(backend)?;
        solver.upload(start)?;
        let contacts = self.advance(&mut *solver, self.substeps)?;
        // Without much contact the scenario would prove little.
        ensure(contacts >= u64::from(self.side), || format!("only {contacts} contacts"))?;
        let mut state = State::default();
        solver.download(&mut state)?;
        Ok(state)
    }
}
