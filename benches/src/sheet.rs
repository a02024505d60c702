//! Linear systems of an implicit step to compare solvers by: a sheet of stiff fabric in folds, or several that lie on each other.

use std::{num::NonZeroUsize, sync::Arc};

use cloth::{
    Aerodynamics, Backend, Cloth, ContactResponse, FabricMaterial, Geometry, GridPatch,
    ImplicitSettings, Integrator, Kernels, LinearVector, Model, ModelBuilder, ModelError,
    NewtonStart, Precision, RestSource, Result, SelfContact, SolverConfig,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
    stepper::{FramePlan, FrameSpan, implicit::system},
};

/// Side of a sheet \[m\].
const SIZE: f64 = 1.0;
/// Folds of a sheet, and their steepest angle.
const FOLDS: f64 = 4.0;
const STEEPEST: f64 = 1.2;
/// How much longer it is than at rest, across the folds.
const STRETCH: f64 = 1.005;
/// How uneven it is, as a share of the spacing.
const UNEVEN: f64 = 0.0035;
/// One particle of so many is knocked \[m/s^2\].
const KNOCKED: f64 = 0.05;
const KNOCK: f64 = 50.0;
const GRAVITY: f64 = 9.81;
/// Distance below which layers touch \[m\], and the share of it that they are apart.
const CONTACT: f64 = 2e-3;
const APART: f64 = 0.9;

/// A system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SheetWorkload {
    /// Particles along a side.
    pub side: u32,
    /// Sheets, which touch each other if there are several.
    pub layers: u32,
    /// How many times as stiff the fabric is as one of 2 and 1 kN/m.
    pub stiffness: f64,
    /// Length of the step \[s\].
    pub step: f64,
}

impl SheetWorkload {
    /// One sheet of this size, at a hundredth of a second.
    #[must_use]
    pub const fn new(side: u32) -> Self {
        Self { side, layers: 1, stiffness: 1.0, step: 0.01 }
    }

    /// Particles.
    #[must_use]
    pub fn particles(&self) -> u64 {
        u64::from(self.layers) * u64::from(self.side) * u64::from(self.side)
    }

    /// The model: sheets that hang from one edge.
    ///
    /// # Errors
    /// For a size that cannot be.
    pub fn model(&self) -> std::result::Result<Arc<Model>, ModelError> {
        let spacing = SIZE / f64::from(self.side - 1);
        let mut builder = ModelBuilder::new();
        for layer in 0..self.layers {
            let mut patch = GridPatch::new([self.side, self.side], spacing);
            patch.origin[2] = APART * CONTACT * f64::from(layer);
            builder = builder.cloth(Cloth {
                name: format!("sheet {layer}"),
                geometry: Geometry::Grid(patch),
                material: self.material().into(),
                pins: (0..self.side).map(|column| self.side * (self.side - 1) + column).collect(),
                velocity: [0.0; 3],
            });
        }
        if self.layers > 1 {
            let response = ContactResponse::Triangles { friction: 0.3 };
            builder = builder.self_contact(SelfContact { distance: CONTACT, response });
        }
        builder.build().map(Arc::new)
    }

    fn material(&self) -> FabricMaterial {
        let curve = |linear| TensileCurve { linear: self.stiffness * linear, cubic: 0.0, end: 1.0 };
        let fabric = Fabric {
            area_density: 0.15,
            thickness: 1e-3,
            warp: curve(2000.0),
            weft: curve(1000.0),
            coupling: 420.0 * self.stiffness,
            shear: 60.0 * self.stiffness,
            bending: BendingRigidity { warp: 1e-5, weft: 1e-5, bias: None },
            friction: InternalFriction::default(),
            damping: [0.0; 2],
            stretch_limit: f64::INFINITY,
        };
        let aerodynamics = Aerodynamics { pressure: 0.0, friction: 0.0 };
        FabricMaterial {
            fabric,
            rest: RestSource::Start { warp: Some([1.0, 0.0, 0.0]) },
            aerodynamics,
            imperfection: 0.0,
        }
    }

    /// Where particles are: in isometric folds if there is one sheet, a little longer than at rest and uneven.
    fn positions(&self, model: &Model, random: &mut impl FnMut() -> f64) -> Vec<[f64; 3]> {
        const PARTS: usize = 20_000;
        let part = 1.0 / PARTS as f64;
        let mut curve = vec![[0.0; 2]];
        for k in 0..PARTS {
            let phase = 2.0 * std::f64::consts::PI * FOLDS * k as f64 * part;
            let (sine, cosine) = (STEEPEST * phase.sin()).sin_cos();
            let [x, z] = curve[k];
            curve.push([x + cosine * part, z + sine * part]);
        }
        let spacing = SIZE / f64::from(self.side - 1);
        let place = |&[x, y, z]: &[f64; 3]| {
            let share = (x / SIZE + 0.5).clamp(0.0, 1.0);
            let [along, up] = match self.layers {
                1 => curve[(share * PARTS as f64).round() as usize],
                _ => [x, z],
            };
            [along, STRETCH * y, up].map(|x| x + UNEVEN * spacing * random())
        };
        model.positions().iter().map(place).collect()
    }

    /// The system, assembled by a backend, pulled by gravity and by knocks on some particles; and the frame that it is of.
    ///
    /// # Errors
    /// What the backend reports.
    pub fn assemble(
        &self,
        backend: &dyn Backend,
        model: &Arc<Model>,
        threads: Option<NonZeroUsize>,
    ) -> Result<(Box<dyn Kernels>, FramePlan)> {
        let config = SolverConfig {
            precision: Precision::F32,
            time_step: self.step,
            threads,
            integrator: Integrator::Implicit(ImplicitSettings::default()),
            ..SolverConfig::default()
        };
        let mut seed = 1_u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let mut state = model.initial_state();
        state.positions = self.positions(model, &mut random);
        let mut kernels = backend.create_kernels(Arc::clone(model), &config)?;
        let mut plan = FramePlan::default();
        let span = FrameSpan {
            time: 0.0,
            duration: self.step,
            wind_velocity: [0.0; 3],
            anchor_offset: [[0.0; 3]; 2],
            from: &[],
            to: &[],
        };
        plan.refill(model, &span, (0.0, 0), self.step);
        kernels.state_write(&state)?;
        kernels.frame_begin(&plan)?;
        kernels.state_keep()?;
        system(&mut *kernels, &plan.substeps[0], NewtonStart::StepStart)?;
        let mut pull = |mass: &f64| {
            let is_knocked = random() > 1.0 - 2.0 * KNOCKED;
            let knock = if is_knocked { KNOCK } else { 0.0 };
            [0.0, -GRAVITY, -GRAVITY].map(|g| self.step * mass * (g + knock * random()))
        };
        let right_side: Vec<[f64; 3]> = model.masses().iter().map(&mut pull).collect();
        kernels.vector_write(LinearVector::RightSide, &right_side)?;
        Ok((kernels, plan))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_touch_and_one_sheet_does_not() {
        let backend = cloth::backend_create("cpu", None).unwrap();
        for (layers, touches) in [(1, false), (3, true)] {
            let workload = SheetWorkload { layers, ..SheetWorkload::new(12) };
            let model = workload.model().unwrap();
            assert_eq!(model.particle_count() as u64, workload.particles());
            let (mut kernels, _) = workload.assemble(&*backend, &model, None).unwrap();
            let mut contacts = Default::default();
            kernels.contacts_read(&mut contacts).unwrap();
            assert_eq!(!contacts.contacts.is_empty(), touches);
        }
    }
}
