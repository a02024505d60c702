//! What can be measured.

use std::{num::NonZeroUsize, sync::Arc};

use cloth::{
    Cloth, Error, Frame, Geometry, GridPatch, Integrator, Mass, MaterialPreset, Model,
    ModelBuilder, ModelError, SolverConfig, SpringCoefficients, StrainLimit,
    scene::{BenchKind, CompileOptions, SceneError, bench_scene},
};
use cloth_benches::{FRAMES_BEFORE, FRAMES_MEASURED, HangWorkload, ITERATION_BYTES, STATE_BYTES};

/// One thing to measure.
#[derive(Clone)]
pub(crate) struct Case {
    /// Which table or plot it is for.
    pub(crate) group: &'static str,
    /// What distinguishes it there.
    pub(crate) label: String,
    pub(crate) cloth: CaseCloth,
    pub(crate) config: SolverConfig,
    pub(crate) frame: Frame,
    /// Frames before those that are timed, and timed.
    pub(crate) frames: [usize; 2],
    /// Bytes that a frame cannot do without.
    pub(crate) bytes: Option<f64>,
    /// What the table was published with for this row.
    pub(crate) published: Option<f64>,
}

/// Why a case came to nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CaseError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Solver(#[from] Error),
}

/// What is simulated.
#[derive(Clone, Copy, Debug)]
pub(crate) enum CaseCloth {
    /// A square patch that falls onto a sphere, with self-contact or without.
    Sphere(u32, bool),
    /// A patch that hangs from two corners, each particle joined to 24 neighbours.
    Hang(HangWorkload),
    /// A square patch of one metre that hangs from two corners, each particle joined to 12 neighbours, with
    /// springs so many times as stiff as explicit integration bears.
    Curtain(u32, f64),
}

/// Stiffness that explicit integration bears, in units of the mass of a particle over the square of the time step.
const CURTAIN_STIFFNESS: f64 = 0.1;
/// Mass of that patch \[kg/m^2\].
const CURTAIN_DENSITY: f64 = 0.25;
/// Time step of that patch \[s\].
pub(crate) const CURTAIN_STEP: f64 = 0.02;

impl Case {
    /// A frame of a sixtieth of a second of the patch that falls onto a sphere.
    pub(crate) fn sphere(group: &'static str, side: u32, contact: bool) -> Result<Self, CaseError> {
        let scene = bench_scene(BenchKind::Sphere, 2, contact);
        let compiled = scene.compile(&CompileOptions::default())?;
        let frame = Frame::per_second(compiled.frames_per_second);
        let substeps = (frame.duration / compiled.config.time_step).round();
        Ok(Self {
            group,
            label: String::new(),
            cloth: CaseCloth::Sphere(side, contact),
            config: compiled.config,
            frame,
            frames: [FRAMES_BEFORE, FRAMES_MEASURED],
            bytes: Some(STATE_BYTES * substeps * f64::from(side).powi(2)),
            published: None,
        })
    }

    /// A step of the patch that hangs.
    pub(crate) fn hang(
        group: &'static str,
        workload: HangWorkload,
        integrator: Integrator,
    ) -> Self {
        let config = workload.config(integrator);
        Self {
            group,
            label: String::new(),
            cloth: CaseCloth::Hang(workload),
            frame: Frame { duration: config.time_step },
            bytes: iterations(&config)
                .map(|count| ITERATION_BYTES * f64::from(count) * workload.particles() as f64),
            config,
            frames: [5, 20],
            published: None,
        }
    }

    /// A step of the patch that hangs, with this integrator and limits of strain.
    pub(crate) fn curtain(
        group: &'static str,
        side: u32,
        stiffness: f64,
        integrator: Integrator,
        limit: Option<StrainLimit>,
    ) -> Self {
        let config = SolverConfig {
            time_step: CURTAIN_STEP,
            integrator,
            strain_limit: limit,
            ..SolverConfig::default()
        };
        Self {
            group,
            label: String::new(),
            cloth: CaseCloth::Curtain(side, stiffness),
            config,
            frame: Frame { duration: CURTAIN_STEP },
            frames: [10, 50],
            bytes: None,
            published: None,
        }
    }

    pub(crate) fn labelled(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    pub(crate) const fn over(mut self, frames: [usize; 2]) -> Self {
        self.frames = frames;
        self
    }

    pub(crate) const fn beside(mut self, published: Option<f64>) -> Self {
        self.published = published;
        self
    }

    pub(crate) fn on_threads(mut self, threads: usize) -> Self {
        self.config.threads = NonZeroUsize::new(threads);
        self
    }

    /// Columns and rows of particles.
    pub(crate) const fn size(&self) -> [u32; 2] {
        match self.cloth {
            CaseCloth::Sphere(side, _) | CaseCloth::Curtain(side, _) => [side, side],
            CaseCloth::Hang(workload) => [workload.side, workload.rows],
        }
    }

    /// Distance of neighbours at rest \[m\].
    pub(crate) fn spacing(&self) -> f64 {
        match self.cloth {
            CaseCloth::Sphere(..) | CaseCloth::Hang(_) => 0.02,
            CaseCloth::Curtain(side, _) => 1.0 / f64::from(side - 1),
        }
    }

    /// Iterations of every linear solve, if it does not stop before.
    pub(crate) const fn iterations(&self) -> Option<u32> {
        iterations(&self.config)
    }

    /// The model, made anew.
    ///
    /// # Errors
    /// For a size that cannot be.
    pub(crate) fn model(&self) -> Result<Arc<Model>, CaseError> {
        match self.cloth {
            CaseCloth::Sphere(side, contact) => {
                let scene = bench_scene(BenchKind::Sphere, side, contact);
                Ok(scene.compile(&CompileOptions::default())?.model)
            }
            CaseCloth::Hang(workload) => Ok(workload.model()?),
            CaseCloth::Curtain(side, stiffness) => Ok(curtain(side, self.spacing(), stiffness)?),
        }
    }
}

/// The cap on iterations of a solve that has no tolerance.
const fn iterations(config: &SolverConfig) -> Option<u32> {
    match &config.integrator {
        Integrator::Implicit(settings) if settings.linear.tolerance == 0.0 => {
            Some(settings.linear.iterations_max)
        }
        _ => None,
    }
}

fn curtain(side: u32, spacing: f64, factor: f64) -> Result<Arc<Model>, ModelError> {
    let mass = CURTAIN_DENSITY * spacing * spacing;
    let stiffness = factor * CURTAIN_STIFFNESS * mass / (CURTAIN_STEP * CURTAIN_STEP);
    let spring = |share| SpringCoefficients { stiffness: share * stiffness, damping: 0.0 };
    let mut material = MaterialPreset::ALL[0].material(spacing);
    material.mass = Mass::PerParticle(mass);
    (material.stretch, material.shear, material.bend) = (spring(1.0), spring(1.0), spring(0.2));
    let cloth = Cloth {
        name: "curtain".into(),
        geometry: Geometry::Grid(GridPatch::horizontal(side, spacing, 0.0)),
        material: material.into(),
        pins: vec![0, side - 1],
        velocity: [0.0; 3],
    };
    ModelBuilder::new().cloth(cloth).build().map(Arc::new)
}
