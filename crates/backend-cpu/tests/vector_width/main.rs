//! The bits are the same whatever the vector units of the processor.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{num::NonZeroUsize, sync::Arc};

use cloth_backend_cpu::CpuBackend;
use cloth_core::{
    Air, Backend, BendModel, Cloth, Collider, ColliderShape, ContactResponse, Frame, Geometry,
    GridPatch, MaterialPreset, Model, ModelBuilder, Pose, Precision, SelfContact, SolverConfig,
    State,
};

/// A patch with springs that buckle, which falls folded onto a ball, in wind, with contact.
fn model(response: ContactResponse) -> Arc<Model> {
    let spacing = 0.02;
    let preset = &MaterialPreset::ALL[0];
    let rigidity = 0.5 * preset.bending * spacing;
    let mut material = preset.material(spacing);
    material.bend.stiffness *= 20.0;
    material.bend_model = BendModel::ImmediateBuckling { rigidity };
    let patch =
        GridPatch { column_axis: [0.6, 0.0, 0.8], ..GridPatch::horizontal(19, spacing, 0.05) };
    let cloth = Cloth {
        name: "patch".into(),
        geometry: Geometry::Grid(patch),
        material: material.into(),
        pins: vec![3],
        velocity: [0.0, 0.0, -2.0],
    };
    let ball = Collider {
        name: "ball".into(),
        shape: ColliderShape::Sphere { radius: 0.1 },
        pose: Pose::from_translation([0.0, 0.0, -0.08]),
        friction: 0.3,
        restitution: 0.2,
    };
    let builder = ModelBuilder::new()
        .cloth(cloth)
        .collider(ball)
        .air(Air::with_wind([3.0, 1.0, 0.0]))
        .self_contact(SelfContact { distance: 0.019, response });
    Arc::new(builder.build().unwrap())
}

fn run(model: &Arc<Model>, backend: &CpuBackend, precision: Precision) -> State {
    let config = SolverConfig { time_step: 2e-4, precision, ..SolverConfig::default() };
    let mut solver = backend.create_solver(Arc::clone(model), &config).unwrap();
    for _ in 0..10 {
        solver.advance(Frame { duration: 0.01 }).unwrap();
        let report = solver.synchronize().unwrap();
        assert!(report.measures.strain_max > 1e-3, "it moves");
    }
    let mut state = State::default();
    solver.download(&mut state).unwrap();
    state
}

#[test]
fn the_width_of_the_vector_units_does_not_change_the_bits() {
    let wide = CpuBackend::new(NonZeroUsize::new(2)).unwrap();
    let narrow = wide.clone().with_narrow_vectors();
    if narrow.info().details == wide.info().details {
        println!(
            "not run here: width of vectors: this processor has no wider ones than its target"
        );
        return;
    }
    let penalty = ContactResponse::Penalty { stiffness: 10.0, damping: 1e-3 };
    let impulse = ContactResponse::Impulse { restitution: 0.1, friction: 0.2 };
    for response in [penalty, impulse] {
        let model = model(response);
        for precision in [Precision::F32, Precision::F64] {
            assert_eq!(run(&model, &wide, precision), run(&model, &narrow, precision));
        }
    }
}
