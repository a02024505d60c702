//! Cloth on planes: friction holds what lies on it with all that this bears, and slows down what slides as Coulomb says.

use std::sync::Arc;

use cloth_core::{
    Collider, ColliderShape, Frame, ImplicitSettings, Integrator, Model, ModelBuilder, Pose,
    SolverConfig, State,
};
use harness::backends::{Candidate, candidates};

use crate::rig::{contact, sheet};

const SPACING: f64 = 0.01;
const DISTANCE: f64 = 4e-3;
/// Tangent of the slope.
const SLOPE: f64 = 0.5;
const GRAVITY: f64 = 9.81;

/// Sheets one on the other on a plane that slopes, which is a field that pulls to the side. All friction is the same.
fn pile(layers: u32, friction: f64) -> Arc<Model> {
    let cos = (1.0 + SLOPE * SLOPE).sqrt().recip();
    let floor = Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::from_translation([3.0, -2.0, 0.0]),
        friction,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new()
        .gravity([GRAVITY * SLOPE * cos, 0.0, -GRAVITY * cos])
        .collider(floor)
        .self_contact(contact(DISTANCE, friction));
    let builder = (0..layers).fold(builder, |builder, layer| {
        let height = 0.48 * DISTANCE + 0.98 * DISTANCE * f64::from(layer);
        let aside = 1.3e-3 * f64::from(layer);
        builder.cloth(sheet(&format!("{layer}"), 7, SPACING, [aside, 0.0, height], 0.0))
    });
    Arc::new(builder.build().expect("it is valid"))
}

/// Where the middle of the lowest sheet is along the slope after each frame of 1/60 s \[m\].
fn way(candidate: &Candidate, model: &Arc<Model>, integrator: Integrator, frames: u32) -> Vec<f64> {
    let time_step = match integrator {
        Integrator::Explicit => (0.9 * model.stable_time_step()).min(1e-3),
        _ => 1.0 / 60.0,
    };
    let precision = candidate.precision;
    let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
    let solver = candidate.backend.create_solver(Arc::clone(model), &config);
    let mut solver = solver.expect("it has contact of triangles");
    let (mut state, count) = (State::default(), model.cloths()[0].particles.len());
    let frames = (0..frames).map(|_| {
        solver.advance(Frame::per_second(60.0)).expect("frames can be computed");
        let report = solver.synchronize().expect("frames can be computed");
        let penetration = report.measures.penetration_max;
        assert!(penetration < 1e-5, "{penetration}");
        solver.download(&mut state).expect("the state can be read");
        state.positions[..count].iter().map(|x| x[0]).sum::<f64>() / count as f64
    });
    frames.collect()
}

fn implicit() -> Integrator {
    Integrator::Implicit(ImplicitSettings::default())
}

/// Three sheets press the lowest one down three times as much: by its own weight alone it would slide.
#[test]
fn friction_holds_a_pile_on_a_slope() {
    for candidate in candidates() {
        let _turn = candidate.turn();
        for (integrator, frames) in [(implicit(), 40), (Integrator::Explicit, 10)] {
            let found = way(candidate, &pile(3, 1.1 * SLOPE), integrator.clone(), frames);
            let drift = found[found.len() - 1] - found[found.len() / 2];
            assert!(drift.abs() < 2e-5, "{} {integrator:?}: {drift}", candidate.label);
        }
    }
}

/// What slides is as fast as Galilei and Coulomb say, to 2 %.
#[test]
fn a_sheet_slides_down_a_slope() {
    let cos = (1.0 + SLOPE * SLOPE).sqrt().recip();
    for candidate in candidates() {
        let _turn = candidate.turn();
        for (integrator, frames) in [(implicit(), 40), (Integrator::Explicit, 10)] {
            let friction = 0.7 * SLOPE;
            let found = way(candidate, &pile(1, friction), integrator.clone(), frames);
            // It has come to lie by then.
            let from = found.len() / 2;
            let gained =
                (found[found.len() - 1] - found[found.len() - 2]) - (found[from + 1] - found[from]);
            let time = (found.len() - 2 - from) as f64 / 60.0;
            let acceleration = gained * 60.0 / time;
            let expected = GRAVITY * cos * (SLOPE - friction);
            let what = format!("{} {integrator:?}: {acceleration}, {expected}", candidate.label);
            assert!((acceleration / expected - 1.0).abs() < 0.02, "{what}");
        }
    }
}
