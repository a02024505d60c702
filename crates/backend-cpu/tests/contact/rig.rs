//! Sheets, and how they are run.

use std::{num::NonZeroUsize, sync::Arc};

use cloth_backend_cpu::CpuBackend;
use cloth_core::{
    Backend, Cloth, ContactResponse, Frame, GridPatch, ImplicitSettings, Integrator,
    MaterialPreset, Model, ModelBuilder, Precision, SelfContact, SemiImplicitSettings, Solver,
    SolverConfig, State, StepReport,
};

use crate::crossings::crossings;

/// A square sheet of jersey around a centre \[m\], turned about the vertical by `angle`.
pub(crate) fn sheet(name: &str, side: u32, spacing: f64, centre: [f64; 3], angle: f64) -> Cloth {
    let (sin, cos) = angle.sin_cos();
    let half = 0.5 * f64::from(side - 1) * spacing;
    let patch = GridPatch {
        column_axis: [cos, sin, 0.0],
        row_axis: [-sin, cos, 0.0],
        origin: [centre[0] - half * (cos - sin), centre[1] - half * (sin + cos), centre[2]],
        ..GridPatch::horizontal(side, spacing, 0.0)
    };
    let material = MaterialPreset::JERSEY.material(spacing);
    Cloth {
        name: name.into(),
        geometry: cloth_core::Geometry::Grid(patch),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

/// Contact of triangles at this distance \[m\].
pub(crate) fn contact(distance: f64, friction: f64) -> SelfContact {
    SelfContact { distance, response: ContactResponse::Triangles { friction } }
}

/// All that a run needs.
pub(crate) struct Run {
    pub(crate) model: Arc<Model>,
    pub(crate) solver: Box<dyn Solver>,
    pub(crate) state: State,
    pub(crate) report: StepReport,
    pub(crate) truncated: u64,
}

impl Run {
    pub(crate) fn new(
        builder: ModelBuilder,
        integrator: Integrator,
        time_step: f64,
        precision: Precision,
        threads: usize,
    ) -> Self {
        let model = Arc::new(builder.build().unwrap());
        let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
        let backend = CpuBackend::new(NonZeroUsize::new(threads)).unwrap();
        let solver = backend.create_solver(Arc::clone(&model), &config).unwrap();
        let state = model.initial_state();
        Self { model, solver, state, report: StepReport::default(), truncated: 0 }
    }

    /// One frame of `duration` \[s\].
    pub(crate) fn frame(&mut self, duration: f64) {
        self.solver.advance(Frame { duration }).unwrap();
        self.report = self.solver.synchronize().unwrap();
        self.truncated += self.report.contact_truncated;
        self.solver.download(&mut self.state).unwrap();
    }

    pub(crate) fn crossings(&self) -> usize {
        crossings(&self.model, &self.state.positions)
    }

    /// Speed of the fastest particle \[m/s\].
    pub(crate) fn speed_max(&self) -> f64 {
        let squares = self.state.velocities.iter().map(|v| v.iter().map(|x| x * x).sum::<f64>());
        squares.fold(0.0, f64::max).sqrt()
    }

    /// Mean height of a cloth within a distance from the vertical axis \[m\].
    pub(crate) fn height_within(&self, cloth: usize, radius: f64) -> f64 {
        let range = self.model.cloths()[cloth].particles.clone();
        let all = &self.state.positions[range.start as usize..range.end as usize];
        let near: Vec<f64> =
            all.iter().filter(|x| x[0].hypot(x[1]) < radius).map(|x| x[2]).collect();
        near.iter().sum::<f64>() / near.len() as f64
    }

    /// Mean height of a cloth \[m\].
    pub(crate) fn height(&self, cloth: usize) -> f64 {
        let range = self.model.cloths()[cloth].particles.clone();
        let all = &self.state.positions[range.start as usize..range.end as usize];
        all.iter().map(|x| x[2]).sum::<f64>() / all.len() as f64
    }
}

/// The integrators with the time steps of these tests \[s\].
pub(crate) fn integrators(model: &Model) -> [(Integrator, f64); 3] {
    let stable = 0.9 * model.stable_time_step();
    [
        (Integrator::Explicit, stable.min(1e-3)),
        (Integrator::Implicit(ImplicitSettings::default()), 1.0 / 120.0),
        (Integrator::SemiImplicit(SemiImplicitSettings::default()), 1.0 / 240.0),
    ]
}

/// Numbers that are the same in each run (splitmix64).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    /// A number in [-1, 1).
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
