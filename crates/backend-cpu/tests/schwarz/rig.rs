//! Systems of an implicit step on which the preconditioner `schwarz` is held to its promises.

use std::{num::NonZeroUsize, sync::Arc};

use cloth_backend_cpu::CpuBackend;
use cloth_core::{
    Aerodynamics, Backend, Cloth, ClothMaterial, Collider, ColliderShape, ContactResponse,
    FabricMaterial, Geometry, GridPatch, ImplicitSettings, Integrator, Kernels, LinearOutcome,
    LinearSettings, LinearStart, LinearVector, MaterialPreset, Model, ModelBuilder, NewtonStart,
    Pose, Precision, Preconditioner, RestSource, SelfContact, SolverConfig,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
    stepper::{FramePlan, FrameSpan, implicit::system},
};

/// Length of a step \[s\].
pub(crate) const STEP: f64 = 0.01;

/// A stiff fabric.
pub(crate) fn fabric() -> ClothMaterial {
    let curve = |linear| TensileCurve { linear, cubic: 0.0, end: 1.0 };
    let fabric = Fabric {
        area_density: 0.15,
        thickness: 1e-3,
        warp: curve(2000.0),
        weft: curve(1000.0),
        coupling: 420.0,
        shear: 60.0,
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
    .into()
}

/// Stiff springs.
pub(crate) fn springs(spacing: f64) -> ClothMaterial {
    let mut material = MaterialPreset::ALL[0].material(spacing);
    material.stretch.stiffness = 2000.0;
    material.shear.stiffness = 500.0;
    material.into()
}

/// A square metre that hangs from one edge.
pub(crate) fn sheet(side: u32, material: impl Fn(f64) -> ClothMaterial) -> Arc<Model> {
    let spacing = 1.0 / f64::from(side - 1);
    let cloth = Cloth {
        name: "sheet".into(),
        geometry: Geometry::Grid(GridPatch::new([side, side], spacing)),
        material: material(spacing),
        pins: (0..side).map(|column| side * (side - 1) + column).collect(),
        velocity: [0.0; 3],
    };
    Arc::new(ModelBuilder::new().cloth(cloth).build().unwrap())
}

/// A sheet that lies on a box in contact of triangles, or hovers far above it.
pub(crate) fn lying(height: f64) -> Arc<Model> {
    let cloth = Cloth {
        name: "sheet".into(),
        geometry: Geometry::Grid(GridPatch::new([48, 48], 0.02)),
        material: fabric(),
        pins: Vec::new(),
        velocity: [0.0; 3],
    };
    let table = Collider {
        name: "table".into(),
        shape: ColliderShape::Box { half_extents: [0.6, 0.6, 0.1] },
        pose: Pose::from_translation([0.0, 0.0, -0.1 - height]),
        friction: 0.5,
        restitution: 0.0,
    };
    let contact =
        SelfContact { distance: 4e-3, response: ContactResponse::Triangles { friction: 0.5 } };
    let builder = ModelBuilder::new().cloth(cloth).collider(table).self_contact(contact);
    Arc::new(builder.build().unwrap())
}

/// Numbers in \[-1, 1\], the same on every run.
pub(crate) fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }
}

/// A sheet in four isometric folds, half a percent longer than at rest, a little uneven; pulled by gravity and by knocks on
/// some particles. The system is assembled.
pub(crate) fn folded(model: &Arc<Model>, precision: Precision, threads: usize) -> Box<dyn Kernels> {
    const PARTS: usize = 20_000;
    let mut curve = vec![[0.0; 2]];
    for part in 0..PARTS {
        let (sine, cosine) =
            (1.2 * (8.0 * std::f64::consts::PI * part as f64 / PARTS as f64).sin()).sin_cos();
        let [x, z] = curve[part];
        curve.push([x + cosine / PARTS as f64, z + sine / PARTS as f64]);
    }
    let mut state = model.initial_state();
    let mut random = numbers();
    let spacing = 1.0 / (model.particle_count() as f64).sqrt();
    for x in &mut state.positions {
        let [along, up] = curve[((x[0] + 0.5).clamp(0.0, 1.0) * PARTS as f64).round() as usize];
        *x = [along, 1.005 * x[1], up].map(|x| x + 0.0035 * spacing * random());
    }
    let mut kernels = assembled(model, &state.positions, precision, threads);
    let right_side: Vec<[f64; 3]> = (model.masses().iter())
        .map(|mass| {
            let is_knocked = random() > 0.9;
            [0.0, -9.81, -9.81]
                .map(|g| STEP * mass * (g + if is_knocked { 50.0 * random() } else { 0.0 }))
        })
        .collect();
    kernels.vector_write(LinearVector::RightSide, &right_side).unwrap();
    kernels
}

/// The system of a model whose particles are at these places, at rest.
pub(crate) fn assembled(
    model: &Arc<Model>,
    positions: &[[f64; 3]],
    precision: Precision,
    threads: usize,
) -> Box<dyn Kernels> {
    assembled_by(&CpuBackend::new(None).unwrap(), model, positions, (precision, threads))
}

/// The same by any backend.
pub(crate) fn assembled_by(
    backend: &dyn Backend,
    model: &Arc<Model>,
    positions: &[[f64; 3]],
    (precision, threads): (Precision, usize),
) -> Box<dyn Kernels> {
    let config = SolverConfig {
        precision,
        time_step: STEP,
        threads: NonZeroUsize::new(threads),
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        ..SolverConfig::default()
    };
    let mut state = model.initial_state();
    state.positions = positions.to_vec();
    let mut kernels = backend.create_kernels(Arc::clone(model), &config).unwrap();
    let mut plan = FramePlan::default();
    let poses: Vec<_> = model.colliders().iter().map(|collider| collider.pose).collect();
    let span = FrameSpan {
        time: 0.0,
        duration: STEP,
        wind_velocity: [0.0; 3],
        anchor_offset: [[0.0; 3]; 2],
        from: &poses,
        to: &poses,
    };
    plan.refill(model, &span, (0.0, 0), STEP);
    kernels.state_write(&state).unwrap();
    kernels.frame_begin(&plan).unwrap();
    kernels.state_keep().unwrap();
    system(&mut *kernels, &plan.substeps[0], NewtonStart::StepStart).unwrap();
    kernels
}

pub(crate) fn solve(kernels: &mut dyn Kernels, settings: &LinearSettings) -> LinearOutcome {
    let settings = LinearSettings { iterations_max: 100_000, ..*settings };
    kernels.preconditioner_build(settings.preconditioner).unwrap();
    let outcome = kernels.conjugate_gradient(&settings, LinearStart::Constraints).unwrap();
    assert!(outcome.converged && !outcome.restarted, "{settings:?}: {outcome:?}");
    outcome
}

pub(crate) const fn settings(preconditioner: Preconditioner) -> LinearSettings {
    LinearSettings {
        method: cloth_core::LinearMethod::ConjugateGradient,
        preconditioner,
        matrix: cloth_core::MatrixForm::MatrixFree,
        stop: cloth_core::LinearStop::Residual,
        tolerance: 1e-3,
        iterations_max: 100_000,
        warm_start: false,
    }
}
