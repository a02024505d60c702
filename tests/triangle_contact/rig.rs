//! Sheets, the backends that have contact of triangles, and runs of these.

use std::sync::Arc;

use cloth::SceneAudit;
use cloth_core::{
    Cloth, ContactResponse, Frame, Geometry, GridPatch, ImplicitSettings, Integrator,
    MaterialPreset, Model, ModelBuilder, NewtonSettings, Precision, SelfContact,
    SemiImplicitSettings, SolverConfig, State,
};
use harness::backends::{Candidate, candidates};

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
    Cloth {
        name: name.into(),
        geometry: Geometry::Grid(patch),
        material: MaterialPreset::JERSEY.material(spacing).into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

/// Contact of triangles at this distance \[m\].
pub(crate) fn contact(distance: f64, friction: f64) -> SelfContact {
    SelfContact { distance, response: ContactResponse::Triangles { friction } }
}

/// The processor in single precision, which the others have to agree with.
pub(crate) fn processor() -> &'static Candidate {
    let mut all = candidates().iter();
    all.find(|candidate| candidate.label == "cpu f32").expect("it is one of them")
}

/// The candidates on GPUs in single precision.
pub(crate) fn others() -> impl Iterator<Item = &'static Candidate> {
    let is_gpu = |label: &str| label.starts_with("wgpu") || label.starts_with("cuda");
    let single = |candidate: &&Candidate| candidate.precision == Precision::F32;
    candidates().iter().filter(single).filter(move |candidate| is_gpu(&candidate.label))
}

/// The integrators with the time steps of these tests \[s\].
pub(crate) fn integrators(model: &Model) -> [(Integrator, f64); 4] {
    let stable = 0.9 * model.stable_time_step();
    let newton = NewtonSettings { iterations_max: 3, tolerance: 1e-3 };
    let iterates = ImplicitSettings { newton, ..ImplicitSettings::default() };
    [
        (Integrator::Implicit(iterates), 1.0 / 120.0),
        (Integrator::Explicit, stable.min(1e-3)),
        (Integrator::Implicit(ImplicitSettings::default()), 1.0 / 120.0),
        (Integrator::SemiImplicit(SemiImplicitSettings::default()), 1.0 / 240.0),
    ]
}

/// What came of a run.
pub(crate) struct Outcome {
    pub(crate) state: State,
    /// Most pairs of triangles that intersect in a frame.
    pub(crate) intersecting: u64,
    /// Ways that were shortened.
    pub(crate) truncated: u64,
    pub(crate) contacts: u64,
    pub(crate) exempt: u64,
}

impl Outcome {
    /// The mean place of a cloth \[m\].
    pub(crate) fn centre(&self, model: &Model, cloth: usize) -> [f64; 3] {
        let range = model.cloths()[cloth].particles.clone();
        let all = &self.state.positions[range.start as usize..range.end as usize];
        let count = all.len() as f64;
        std::array::from_fn(|k| all.iter().map(|x| x[k]).sum::<f64>() / count)
    }
}

/// Runs a model for some frames of 1/60 s.
pub(crate) fn run(
    candidate: &Candidate,
    builder: ModelBuilder,
    (integrator, time_step): (Integrator, f64),
    frames: u32,
) -> (Arc<Model>, Outcome) {
    let model = Arc::new(builder.build().expect("the scenes are valid"));
    let audit = SceneAudit::new(&model);
    let precision = candidate.precision;
    let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
    let solver = candidate.backend.create_solver(Arc::clone(&model), &config);
    let mut solver = solver.expect("it has contact of triangles");
    let mut outcome =
        Outcome { state: State::default(), intersecting: 0, truncated: 0, contacts: 0, exempt: 0 };
    for frame in 1..=frames {
        solver.advance(Frame::per_second(60.0)).expect("frames can be computed");
        let report = solver.synchronize().expect("frames can be computed");
        outcome.truncated += report.contact_truncated;
        outcome.contacts = outcome.contacts.max(report.contacts);
        outcome.exempt = outcome.exempt.max(report.contact_exempt);
        solver.download(&mut outcome.state).expect("the state can be read");
        let state = &outcome.state;
        let found = audit.at(&state.positions, &state.colliders, f64::from(frame) / 60.0);
        outcome.intersecting = outcome.intersecting.max(found.pairs());
    }
    (model, outcome)
}
