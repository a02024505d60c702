//! Frames of many substeps of one regular patch, which backends may do in a way of their own.

use std::sync::Arc;

use cloth_core::{
    Backend, Collider, ColliderShape, ContactResponse, Frame, GridPatch, Integrator, Model,
    ModelBuilder, Pose, Precision, SelfContact, SolverConfig, State, Stencil,
};

use crate::{
    Verdict,
    bits::first_difference,
    models::{fold, grid_cloth, material},
    verdict::ensure,
};

/// Length of a substep of the explicit integrator \[s\], and of those with large steps.
const TIME_STEPS: [f64; 2] = [5e-4, 0.01];
/// Distance of neighbouring particles \[m\].
const SPACING: f64 = 0.02;

/// A patch, part of it folded over, that falls on a ball.
#[derive(Clone, Debug)]
pub struct PatchFrames {
    /// Particles along the first side.
    pub columns: u32,
    /// Particles along the second side.
    pub rows: u32,
    /// Its springs.
    pub stencil: Stencil,
    /// Whether it is in contact with itself, by penalties.
    pub contact: bool,
    /// Whether the ball is there.
    pub collider: bool,
    /// How the state is advanced.
    pub integrator: Integrator,
    /// Precision.
    pub precision: Precision,
    /// Substeps of each frame.
    pub frames: &'static [u32],
}

impl PatchFrames {
    /// A patch of 12 neighbours in single precision, advanced by the explicit integrator in frames of one substep, of an even
    /// and of an odd number; with the ball, without contact with itself.
    #[must_use]
    pub const fn explicit([columns, rows]: [u32; 2]) -> Self {
        Self {
            columns,
            rows,
            stencil: Stencil::Neighbours12,
            contact: false,
            collider: true,
            integrator: Integrator::Explicit,
            precision: Precision::F32,
            frames: &[1, 2, 17, 6],
        }
    }

    /// The model.
    ///
    /// # Errors
    /// `InvalidModel`.
    pub fn model(&self) -> cloth_core::Result<Arc<Model>> {
        let patch = GridPatch {
            columns: self.columns,
            rows: self.rows,
            stencil: self.stencil,
            ..GridPatch::horizontal(2, SPACING, 0.03)
        };
        let ball = Collider {
            name: "ball".into(),
            shape: ColliderShape::Sphere { radius: 0.15 },
            pose: Pose::from_translation([0.0, 0.0, -0.13]),
            friction: 0.3,
            restitution: 0.0,
        };
        let mut material = material(1e-4, 10.0, 2e-3);
        material.bend.stiffness = 2.0;
        for springs in [&mut material.stretch, &mut material.shear, &mut material.bend] {
            springs.damping = 5e-3;
        }
        let mut cloth = grid_cloth("cloth", patch, material);
        cloth.pins = vec![0, self.columns - 1];
        let mut builder = ModelBuilder::new().cloth(cloth);
        if self.collider {
            builder = builder.collider(ball);
        }
        if self.contact {
            let response = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
            builder = builder.self_contact(SelfContact { distance: 0.9 * SPACING, response });
        }
        Ok(Arc::new(builder.build()?))
    }

    /// Length of a substep \[s\].
    #[must_use]
    pub fn time_step(&self) -> f64 {
        TIME_STEPS[usize::from(self.integrator != Integrator::Explicit)]
    }

    /// The state that `model` starts from.
    #[must_use]
    pub fn start(&self, model: &Model) -> State {
        let mut state = model.initial_state();
        // So that one part lies on another, and a third by itself.
        let place = (0.6 * f64::from(self.columns)).floor() + 0.1;
        fold(&mut state, place * SPACING, 0.8 * SPACING);
        // Springs without a length, one of them at the edge.
        let [columns, rows] = [self.columns, self.rows].map(|side| side as usize);
        for particle in [1, rows / 2 * columns + columns / 2] {
            state.positions[particle] = state.positions[particle + 1];
        }
        state
    }

    /// The state at the end of all frames.
    ///
    /// # Errors
    /// Those of the backend.
    pub fn run(&self, backend: &dyn Backend) -> cloth_core::Result<State> {
        let model = self.model()?;
        let mut state = self.start(&model);
        let time_step = self.time_step();
        let config = SolverConfig {
            precision: self.precision,
            time_step,
            integrator: self.integrator.clone(),
            strain_bound: 1e3,
            ..SolverConfig::default()
        };
        let mut solver = backend.create_solver(model, &config)?;
        solver.upload(&state)?;
        for &substeps in self.frames {
            solver.advance(Frame { duration: f64::from(substeps) * time_step })?;
        }
        solver.download(&mut state)?;
        Ok(state)
    }
}

/// Both backends end in the same bits, which are not those of the start.
///
/// # Errors
/// The first difference.
pub fn patch_frames(backends: [&dyn Backend; 2], patch: &PatchFrames) -> Verdict {
    let [first, second] = [patch.run(backends[0])?, patch.run(backends[1])?];
    let difference = first_difference(&first, &second);
    ensure(difference.is_none(), || {
        let i = difference.unwrap_or_default();
        let of = |state: &State| (state.positions[i], state.velocities[i]);
        format!("{patch:?}: particle {i} is at {:?} and {:?}", of(&first), of(&second))
    })?;
    let speeds = first.velocities.iter().map(|v| v.iter().map(|v| v * v).sum::<f64>());
    let fastest = speeds.fold(0.0, f64::max);
    ensure(fastest > 0.1 && fastest < 100.0, || format!("{patch:?}: the fastest has {fastest}"))
}
