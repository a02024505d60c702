//! Sheets, bodies, and runs of both.

use std::{num::NonZeroUsize, sync::Arc};

use cloth_audit::{Surface, intersections};
use cloth_backend_cpu::CpuBackend;
use cloth_backend_reference::ReferenceBackend;
use cloth_core::{
    Backend, BodySurface, Cloth, Collider, ColliderControl, ColliderShape, ContactResponse,
    Control, Error, Frame, Geometry, GridPatch, ImplicitSettings, Integrator, MaterialPreset,
    Model, ModelBuilder, Pose, Precision, SelfContact, Solver, SolverConfig, State,
};

/// Contact distance \[m\].
pub(crate) const DISTANCE: f64 = 2e-3;

/// A square sheet of jersey around a centre \[m\].
pub(crate) fn sheet(name: &str, side: u32, spacing: f64, centre: [f64; 3]) -> Cloth {
    let half = 0.5 * f64::from(side - 1) * spacing;
    let patch = GridPatch {
        origin: [centre[0] - half, centre[1] - half, centre[2]],
        ..GridPatch::horizontal(side, spacing, 0.0)
    };
    let mut material = MaterialPreset::JERSEY.material(spacing);
    material.thickness = DISTANCE;
    Cloth {
        name: name.into(),
        geometry: Geometry::Grid(patch),
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

/// The particles at the border of such a sheet.
pub(crate) fn border(side: u32) -> Vec<u32> {
    let on_border = |i: u32, j: u32| i == 0 || j == 0 || i == side - 1 || j == side - 1;
    (0..side * side).filter(|k| on_border(k % side, k / side)).collect()
}

pub(crate) fn body(name: &str, shape: ColliderShape, translation: [f64; 3]) -> Collider {
    Collider {
        name: name.into(),
        shape,
        pose: Pose::from_translation(translation),
        friction: 0.3,
        restitution: 0.0,
    }
}

pub(crate) fn mesh(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> ColliderShape {
    ColliderShape::Surface(Arc::new(BodySurface::rigid(positions, triangles)))
}

/// Contact of triangles.
pub(crate) const fn triangles(friction: f64) -> SelfContact {
    SelfContact { distance: DISTANCE, response: ContactResponse::Triangles { friction } }
}

/// Contact between points, which lets faces of bodies pass.
pub(crate) const fn points() -> SelfContact {
    SelfContact {
        distance: DISTANCE,
        response: ContactResponse::Impulse { restitution: 0.0, friction: 0.3 },
    }
}

/// The processor with so many threads.
pub(crate) fn processor(threads: usize) -> CpuBackend {
    CpuBackend::new(NonZeroUsize::new(threads)).expect("there is a processor")
}

pub(crate) fn reference() -> ReferenceBackend {
    ReferenceBackend::new()
}

pub(crate) fn implicit() -> (Integrator, f64) {
    (Integrator::Implicit(ImplicitSettings::default()), 1.0 / 240.0)
}

/// Explicit steps that are stable.
pub(crate) fn explicit(model: &Model) -> (Integrator, f64) {
    (Integrator::Explicit, (0.9 * model.stable_time_step()).min(1e-3))
}

/// A run that goes on frame by frame.
pub(crate) struct Run {
    pub(crate) model: Arc<Model>,
    pub(crate) solver: Box<dyn Solver>,
    pub(crate) state: State,
    pub(crate) contacts: u64,
    pub(crate) truncated: u64,
    /// Largest number of pairs of triangles of cloth and bodies, and of cloths, that intersect in a frame.
    pub(crate) bodies: u64,
    pub(crate) cloths: u64,
    /// The model whose bodies are looked at.
    audited: Arc<Model>,
    time: f64,
}

impl Run {
    pub(crate) fn new(
        backend: &dyn Backend,
        model: &Arc<Model>,
        (integrator, time_step): (Integrator, f64),
        precision: Precision,
    ) -> Self {
        let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
        Self::of_config(backend, model, &config)
    }

    pub(crate) fn of_config(
        backend: &dyn Backend,
        model: &Arc<Model>,
        config: &SolverConfig,
    ) -> Self {
        let solver = backend.create_solver(Arc::clone(model), config);
        let mut run = Self {
            solver: solver.expect("it has contact of triangles"),
            state: State::default(),
            contacts: 0,
            truncated: 0,
            bodies: 0,
            cloths: 0,
            audited: Arc::clone(model),
            model: Arc::clone(model),
            time: 0.0,
        };
        run.solver.download(&mut run.state).expect("the state can be read");
        run.audit();
        assert_eq!((run.bodies, run.cloths), (0, 0), "the start intersects");
        run
    }

    /// Counts with the bodies of another model.
    pub(crate) fn audited_as(mut self, model: &Arc<Model>) -> Self {
        self.audited = Arc::clone(model);
        self
    }

    fn audit(&mut self) {
        let cloths: Vec<_> = (self.model.cloths().iter())
            .map(|cloth| {
                let (particles, triangles) = (cloth.particles.clone(), cloth.triangles.clone());
                let first = particles.start;
                let all = &self.model.triangles()[triangles.start as usize..triangles.end as usize];
                let triangles = all.iter().map(|triangle| triangle.map(|i| i - first));
                let positions = &self.state.positions[first as usize..particles.end as usize];
                (positions, triangles.collect::<Vec<_>>())
            })
            .collect();
        let bodies: Vec<_> = (self.audited.colliders().iter().enumerate())
            .filter_map(|(number, collider)| {
                let triangles = collider.shape.body_triangles()?;
                let pose = self.state.colliders.get(number).unwrap_or(&collider.pose);
                let rows = pose.rotation_rows();
                let place = |x: &[f64; 3]| -> [f64; 3] {
                    std::array::from_fn(|k| {
                        let turned: f64 = (0..3).map(|j| rows[k][j] * x[j]).sum();
                        pose.translation[k] + turned
                    })
                };
                let local = collider.shape.body_positions(collider.shape.sets_at(self.time));
                Some((local.iter().map(place).collect::<Vec<_>>(), triangles))
            })
            .collect();
        let surfaces: Vec<_> = (cloths.iter().map(|(x, t)| Surface::cloth(x, t)))
            .chain(bodies.iter().map(|(x, t)| Surface::body(x, t)))
            .collect();
        let found = intersections(&surfaces);
        assert_eq!(found.unusable, 0);
        self.bodies = self.bodies.max(found.bodies);
        self.cloths = self.cloths.max(found.within + found.between);
    }

    /// A frame of so many to a second, with colliders moved to these poses.
    pub(crate) fn frame(&mut self, rate: f64, poses: &[Pose]) -> Result<(), Error> {
        let colliders = (0..).zip(poses);
        let colliders = colliders.map(|(collider, &pose)| ColliderControl { collider, pose });
        let control = Control { colliders: colliders.collect(), ..Control::default() };
        self.solver.set_control(&control)?;
        self.solver.advance(Frame::per_second(rate))?;
        let report = self.solver.synchronize()?;
        self.contacts = self.contacts.max(report.contacts);
        self.truncated += report.contact_truncated;
        assert_eq!(report.contact_exempt, 0);
        self.solver.download(&mut self.state)?;
        self.time += 1.0 / rate;
        self.audit();
        Ok(())
    }

    pub(crate) fn lowest(&self) -> f64 {
        self.state.positions.iter().fold(f64::INFINITY, |low, x| low.min(x[2]))
    }
}

pub(crate) fn build(builder: ModelBuilder) -> Arc<Model> {
    Arc::new(builder.build().expect("the scenes are valid"))
}
