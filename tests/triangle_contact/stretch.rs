//! Fabric that falls on an edge is nowhere stretched beyond its limit, on every backend, and without one it is.

use std::sync::Arc;

use cloth::SceneAudit;
use cloth_core::{
    Aerodynamics, Cloth, Collider, ColliderShape, FabricAudit, FabricMaterial, Frame, Geometry,
    GridPatch, Integrator, Model, ModelBuilder, Pose, RestSource, SolverConfig, State,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve, USUAL_DAMPING},
};
use harness::{backends::Candidate, bits::first_difference};

use crate::{
    bits::pairs,
    rig::{contact, integrators, others, processor},
};

const SIDE: u32 = 17;
const FRAMES: u32 = 6;
/// The limit.
const LARGEST: f64 = 1.03;

/// A soft knit that hits a bar at 4 m/s.
fn model(stretch_limit: f64) -> Arc<Model> {
    let curve = TensileCurve { linear: 40.0, cubic: 200.0, end: 0.3 };
    let fabric = Fabric {
        area_density: 0.2,
        thickness: 1e-3,
        warp: curve,
        weft: curve,
        coupling: 5.0,
        shear: 10.0,
        bending: BendingRigidity::isotropic(2e-6),
        friction: InternalFriction::default(),
        damping: USUAL_DAMPING,
        stretch_limit,
    };
    let cloth = Cloth {
        name: "knit".into(),
        geometry: Geometry::Grid(GridPatch::horizontal(SIDE, 0.01, 0.02)),
        material: FabricMaterial {
            fabric,
            rest: RestSource::Pattern { scale: 1.0 },
            aerodynamics: Aerodynamics::default(),
            imperfection: 0.0,
        }
        .into(),
        pins: vec![],
        velocity: [0.0, 0.0, -4.0],
    };
    let bar = Collider {
        name: "bar".into(),
        shape: ColliderShape::Box { half_extents: [0.004, 0.2, 0.004] },
        pose: Pose::from_translation([0.003, 0.01, 0.0]),
        friction: 0.3,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new().self_contact(contact(2e-3, 0.3));
    Arc::new(builder.cloth(cloth).collider(bar).build().expect("it is valid"))
}

/// The largest stretch and how many pairs of triangles intersect in any frame, and the last state.
fn run(
    candidate: &Candidate,
    model: &Arc<Model>,
    (integrator, time_step): (Integrator, f64),
) -> (f64, u64, State) {
    let audit = SceneAudit::new(model);
    let precision = candidate.precision;
    let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
    let solver = candidate.backend.create_solver(Arc::clone(model), &config);
    let mut solver = solver.expect("it has contact of triangles");
    let (mut largest, mut intersecting, mut state) = (0.0_f64, 0, State::default());
    for frame in 1..=FRAMES {
        solver.advance(Frame::per_second(60.0)).expect("frames can be computed");
        solver.synchronize().expect("frames can be computed");
        solver.download(&mut state).expect("the state can be read");
        let fabric = FabricAudit::new(model, &state.positions).expect("it is of fabric");
        largest = largest.max(fabric.stretches[1]);
        let found = audit.at(&state.positions, &state.colliders, f64::from(frame) / 60.0);
        intersecting += found.pairs();
    }
    (largest, intersecting, state)
}

/// Implicit steps: a tight limit is stiff, and explicit ones take minutes on a device of software.
fn ways(model: &Model) -> Vec<(Integrator, f64)> {
    let is_one = |way: &(Integrator, f64)| matches!(way.0, Integrator::Implicit(_));
    integrators(model).into_iter().filter(is_one).collect()
}

#[test]
fn no_triangle_is_stretched_beyond_its_limit() {
    let [bounded, free] = [LARGEST, f64::INFINITY].map(model);
    for candidate in others().chain([processor()]) {
        let _turn = candidate.turn();
        for way in ways(&bounded) {
            let what = format!("{} {:?}", candidate.label, way.0);
            let (largest, intersecting, _) = run(candidate, &bounded, way.clone());
            assert!(largest < LARGEST + 1e-5, "{what}: {largest}");
            assert!(largest > 1.02, "{what}: {largest}, nothing has come near it");
            assert_eq!(intersecting, 0, "{what}");
        }
        let (largest, ..) = run(candidate, &free, ways(&bounded)[0].clone());
        assert!(largest > LARGEST + 0.02, "{}: {largest} without a limit", candidate.label);
    }
}

#[test]
fn cuda_limits_as_the_processor() {
    let model = model(LARGEST);
    for [cuda, cpu] in pairs() {
        for way in ways(&model) {
            let [expected, found] = [cpu, cuda].map(|one| run(one, &model, way.clone()).2);
            assert_eq!(first_difference(&expected, &found), None, "{} {:?}", cuda.label, way.0);
        }
    }
}
