//! The same bits for any number of threads and after a stop, and the reference.

use cloth_core::{
    ColliderShape, Model, ModelBuilder, Pose, Precision, State,
    contact::{Candidate, ContactSurface},
};
use std::sync::Arc;

use crate::rig::{Run, body, build, explicit, implicit, processor, reference, sheet, triangles};

/// A small sheet that falls onto a box which turns and rises.
fn model() -> Arc<Model> {
    let shape = ColliderShape::Box { half_extents: [0.022, 0.02, 0.01] };
    let cloth = sheet("sheet", 7, 0.0153, [0.003, 0.002, 0.0135]);
    let builder = ModelBuilder::new().cloth(cloth).collider(body("body", shape, [0.0; 3]));
    build(builder.self_contact(triangles(0.3)))
}

fn pose(frame: u32) -> Pose {
    let turn = 0.01 * f64::from(frame);
    Pose {
        translation: [0.0, 0.0, 2e-4 * f64::from(frame)],
        rotation: [0.0, 0.0, turn.sin(), turn.cos()],
    }
}

#[test]
fn threads_do_not_matter() {
    let model = model();
    for precision in [Precision::F32, Precision::F64] {
        for way in [implicit(), explicit(&model)] {
            let states: Vec<State> = [1, 2, 8]
                .into_iter()
                .map(|threads| {
                    let backend = processor(threads);
                    let mut run = Run::new(&backend, &model, way.clone(), precision);
                    for frame in 1..=10 {
                        run.frame(60.0, &[pose(frame)]).unwrap();
                    }
                    assert!(run.contacts > 0);
                    run.state
                })
                .collect();
            assert!(states.iter().all(|state| *state == states[0]));
        }
    }
}

#[test]
fn a_run_goes_on_with_the_same_bits() {
    let model = model();
    for way in [implicit(), explicit(&model)] {
        let mut whole = Run::new(&processor(2), &model, way.clone(), Precision::F32);
        let mut second = Run::new(&processor(2), &model, way, Precision::F32);
        for frame in 1..=10 {
            whole.frame(60.0, &[pose(frame)]).unwrap();
            if frame == 5 {
                second.solver.upload(&whole.state).unwrap();
            } else if frame > 5 {
                second.frame(60.0, &[pose(frame)]).unwrap();
            }
        }
        assert_eq!(whole.state, second.state);
    }
}

#[test]
fn the_reference_does_the_same() {
    let model = model();
    for way in [implicit(), explicit(&model)] {
        let [mut ours, mut theirs] = [
            Run::new(&processor(2), &model, way.clone(), Precision::F64),
            Run::new(&reference(), &model, way, Precision::F64),
        ];
        for frame in 1..=3 {
            ours.frame(60.0, &[pose(frame)]).unwrap();
            theirs.frame(60.0, &[pose(frame)]).unwrap();
        }
        assert!(theirs.contacts > 0 && theirs.bodies == 0);
        let apart = (ours.state.positions.iter().flatten())
            .zip(theirs.state.positions.iter().flatten())
            .fold(0.0_f64, |apart, (a, b)| apart.max((a - b).abs()));
        println!("{apart:e} m");
        assert!(apart < 1e-8, "{apart}");
        assert_eq!(ours.contacts, theirs.contacts);
    }
}

/// Pairs of features of bodies are no candidates, all others with bodies are.
#[test]
fn bodies_are_no_pairs_among_themselves() {
    let model = model();
    let contact = *model.self_contact().unwrap();
    let surface = ContactSurface::new(&model, &contact);
    assert_eq!((surface.node_count(), surface.triangles().len()), (57, 84));
    let (mut vertex_triangle, mut edge_edge) = ([0; 2], 0);
    for candidate in surface.candidates() {
        let bodies = surface.particles(candidate).map(|node| surface.is_of_body(node));
        match (candidate, bodies) {
            (Candidate::VertexTriangle(_), [true, false, false, false]) => vertex_triangle[0] += 1,
            (Candidate::VertexTriangle(_), [false, true, true, true]) => vertex_triangle[1] += 1,
            (Candidate::EdgeEdge(_), [false, false, true, true]) => edge_edge += 1,
            (_, bodies) => assert_eq!(bodies, [false; 4]),
        }
    }
    let edges = (surface.edges().len() - 18) * 18;
    assert_eq!((vertex_triangle, edge_edge), ([8 * 72, 49 * 12], edges));
}
