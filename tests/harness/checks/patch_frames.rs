//! Frames of many substeps of one regular patch, which backends may do in a way of their own.

use std::sync::Arc;

use cloth_core::{
    Aerodynamics, Air, Backend, Collider, ColliderControl, ColliderShape, ContactResponse, Control,
    FabricMaterial, Field, FieldProgram, Frame, GridPatch, Integrator, Model, ModelBuilder, Pose,
    Precision, RestSource, SelfContact, SolverConfig, State, Stencil, StrainLimit,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
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

/// Speed of a patch that is thrown \[m/s\]: its particles go as far in a substep as they are apart.
const THROW: f64 = SPACING / TIME_STEPS[0];

/// A patch, part of it folded over, that falls on a ball.
#[derive(Clone, Debug)]
pub struct PatchFrames {
    /// Particles along the first side.
    pub columns: u32,
    /// Particles along the second side.
    pub rows: u32,
    /// Its springs.
    pub stencil: Stencil,
    /// Whether its triangles touch each other.
    pub triangles: bool,
    /// Whether it is of fabric instead.
    pub fabric: bool,
    /// Whether it is in contact with itself, by penalties.
    pub contact: bool,
    /// Whether it is by impulses instead.
    pub impulses: bool,
    /// Sweeps of the strain limit, which is tight enough to have work; 0 for none.
    pub sweeps: u32,
    /// Whether the ball is there.
    pub collider: bool,
    /// Whether it is as small as a bead, and the patch so fast that it would be past it after a substep.
    pub thrown: bool,
    /// How the state is advanced.
    pub integrator: Integrator,
    /// Precision.
    pub precision: Precision,
    /// Substeps of each frame.
    pub frames: &'static [u32],
    /// Whether there is more around it: air with wind, a uniform field, drag, an expression, and colliders that move.
    pub surroundings: bool,
}

/// A fabric with all that one can have, as heavy and about as stiff as the springs.
fn fabric() -> FabricMaterial {
    let curve = |linear| TensileCurve { linear, cubic: 300.0, end: 0.08 };
    let fabric = Fabric {
        area_density: 0.25,
        thickness: 2e-3,
        warp: curve(12.0),
        weft: curve(8.0),
        coupling: 3.0,
        shear: 3.0,
        bending: BendingRigidity { warp: 2e-5, weft: 1e-5, bias: None },
        friction: InternalFriction::default(),
        damping: [1e-4, 2e-4],
        stretch_limit: 1.15,
    };
    let rest = RestSource::Pattern { scale: 1.0 };
    FabricMaterial {
        fabric,
        rest,
        aerodynamics: Aerodynamics { pressure: 1.0, friction: 0.05 },
        imperfection: 0.0,
    }
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
            triangles: false,
            fabric: false,
            contact: false,
            impulses: false,
            sweeps: 0,
            collider: true,
            thrown: false,
            integrator: Integrator::Explicit,
            precision: Precision::F32,
            frames: &[1, 2, 17, 6],
            surroundings: false,
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
        let (radius, translation) = if self.thrown {
            // Below a particle of the part that is not folded.
            let [column, row] = [self.columns / 4, self.rows / 4].map(f64::from);
            let mut place: [f64; 3] = std::array::from_fn(|axis| {
                let along = column * patch.column_axis[axis] + row * patch.row_axis[axis];
                patch.origin[axis] + SPACING * along
            });
            place[0] += 1e-3;
            place[2] -= 0.5 * THROW * TIME_STEPS[0];
            (4e-3, place)
        } else {
            (0.15, [0.0, 0.0, -0.13])
        };
        let ball = Collider {
            name: "ball".into(),
            shape: ColliderShape::Sphere { radius },
            pose: Pose::from_translation(translation),
            friction: 0.3,
            restitution: 0.0,
        };
        let mut material = material(1e-4, 10.0, 2e-3);
        material.bend.stiffness = 2.0;
        for springs in [&mut material.stretch, &mut material.shear, &mut material.bend] {
            springs.damping = 5e-3;
        }
        let mut cloth = grid_cloth("cloth", patch, material);
        if self.fabric {
            cloth.material = fabric().into();
        }
        cloth.pins = vec![0, self.columns - 1];
        let mut builder = ModelBuilder::new().cloth(cloth);
        if self.collider {
            builder = builder.collider(ball);
        }
        if self.contact {
            let response = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };
            builder = builder.self_contact(SelfContact { distance: 0.9 * SPACING, response });
        }
        if self.triangles {
            let response = ContactResponse::Triangles { friction: 0.3 };
            builder = builder.self_contact(SelfContact { distance: 0.9 * SPACING, response });
        }
        if self.impulses {
            let response = ContactResponse::Impulse { restitution: 0.2, friction: 0.3 };
            builder = builder.self_contact(SelfContact { distance: 0.9 * SPACING, response });
        }
        if self.surroundings {
            let field = FieldProgram::compile("m * vec3(sin(20 * x.y + t), 0, -0.2 * v.z)");
            let program = field.unwrap_or_else(|error| panic!("{error}"));
            builder = builder
                .field(Field::Uniform { acceleration: [0.5, 0.0, 1.0] })
                .field(Field::Drag { rate: [0.3, 0.2, 0.1] })
                .field(Field::Procedural { program: Arc::new(program) })
                .air(Air::with_wind([2.0, 1.0, 0.5]));
        }
        Ok(Arc::new(builder.build()?))
    }

    /// The strain limit, if there is one.
    #[must_use]
    pub fn strain_limit(&self) -> Option<StrainLimit> {
        let sweeps = self.sweeps;
        (sweeps > 0).then(|| StrainLimit { ratio: 1.005, sweeps, ..StrainLimit::default() })
    }

    /// What is to happen in a frame.
    fn control(&self, model: &Model, frame: usize) -> Control {
        if !self.surroundings {
            return Control::default();
        }
        let moved = |(number, collider): (u32, &Collider)| {
            let mut pose = collider.pose;
            pose.translation[2] += 2e-3 * (frame + 1) as f64;
            ColliderControl { collider: number, pose }
        };
        Control {
            colliders: (0..).zip(model.colliders()).map(moved).collect(),
            wind_velocity: Some([2.0, frame as f64, 0.5]),
            ..Control::default()
        }
    }

    /// Length of a substep \[s\].
    #[must_use]
    pub fn time_step(&self) -> f64 {
        TIME_STEPS[usize::from(self.integrator != Integrator::Explicit)]
    }

    /// Settings of a solver for it.
    #[must_use]
    pub fn config(&self) -> SolverConfig {
        SolverConfig {
            precision: self.precision,
            time_step: self.time_step(),
            integrator: self.integrator.clone(),
            strain_limit: self.strain_limit(),
            strain_bound: 1e3,
            ..SolverConfig::default()
        }
    }

    /// The state that `model` starts from.
    #[must_use]
    pub fn start(&self, model: &Model) -> State {
        let mut state = model.initial_state();
        if self.thrown {
            let held = state.held.iter();
            for (velocity, _) in state.velocities.iter_mut().zip(held).filter(|(_, h)| **h == 0) {
                velocity[2] = -THROW;
            }
        }
        // So that one part lies on another, and a third by itself.
        let place = (0.6 * f64::from(self.columns)).floor() + 0.1;
        fold(&mut state, place * SPACING, 0.8 * SPACING);
        if self.fabric {
            // Where corners coincide the forces of a fold have no bound.
            return state;
        }
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
        self.run_from(backend, &self.start(&model))
    }

    /// The same from any state.
    ///
    /// # Errors
    /// Those of the backend.
    pub fn run_from(&self, backend: &dyn Backend, start: &State) -> cloth_core::Result<State> {
        let model = self.model()?;
        let time_step = self.time_step();
        let mut solver = backend.create_solver(model.clone(), &self.config())?;
        solver.upload(start)?;
        for (frame, &substeps) in self.frames.iter().enumerate() {
            solver.set_control(&self.control(&model, frame))?;
            solver.advance(Frame { duration: f64::from(substeps) * time_step })?;
        }
        let mut state = State::default();
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
