//! Bodies that make no sense, or too much of it.

use cloth_core::{
    AdaptiveSettings, BodySurface, Collider, ColliderShape, Error, ModelBuilder, ModelError, Pose,
    Precision, SolverConfig, TimeStepControl,
};
use std::sync::Arc;

use crate::rig::{Run, body, border, build, implicit, mesh, points, processor, sheet, triangles};

fn block() -> ColliderShape {
    ColliderShape::Box { half_extents: [0.05, 0.05, 0.02] }
}

/// A sheet that is held at its border, with bodies.
fn held(bodies: impl IntoIterator<Item = Collider>) -> ModelBuilder {
    let mut cloth = sheet("sheet", 9, 0.0153, [0.003, 0.002, 0.0]);
    cloth.pins = border(9);
    let builder = ModelBuilder::new().cloth(cloth).self_contact(triangles(0.3));
    bodies.into_iter().fold(builder, ModelBuilder::collider)
}

#[test]
fn a_body_that_jumps_over_cloth_is_named() {
    let model = build(held([body("ram", block(), [0.0, 0.0, -0.1])]));
    let mut run = Run::new(&processor(2), &model, implicit(), Precision::F32);
    let above = Pose::from_translation([0.0, 0.0, 2.0]);
    match run.frame(60.0, &[above]) {
        Err(error @ Error::BodyJumps { .. }) => {
            let text = error.to_string();
            assert!(text.contains("\"ram\"") && text.contains("places in between"), "{text}");
        }
        other => panic!("{other:?}"),
    }
    // Where no cloth is, a body may jump.
    let mut run = Run::new(&processor(2), &model, implicit(), Precision::F32);
    run.frame(60.0, &[Pose::from_translation([0.0, 0.0, -5.0])]).unwrap();
    assert_eq!(run.bodies, 0);
}

#[test]
fn cloth_that_bodies_pinch_is_told_with_the_place() {
    let bodies =
        [body("anvil", block(), [0.0, 0.0, -0.025]), body("hammer", block(), [0.0, 0.0, 0.03])];
    let model = build(held(bodies));
    let adaptive =
        AdaptiveSettings { halvings_max: 3, strain_max: 10.0, ..AdaptiveSettings::default() };
    // Shorter substeps are tried first, if they may be: no length is short enough here.
    for time_step_control in [TimeStepControl::Fixed, TimeStepControl::Adaptive(adaptive)] {
        let (integrator, time_step) = implicit();
        let config =
            SolverConfig { integrator, time_step, time_step_control, ..SolverConfig::default() };
        let mut run = Run::of_config(&processor(2), &model, &config);
        let below = Pose::from_translation([0.0, 0.0, 0.01]);
        let error = (0..3).find_map(|_| {
            run.frame(60.0, &[Pose::from_translation([0.0, 0.0, -0.025]), below]).err()
        });
        let Some(Error::PinchedByBody { collider, place, all }) = error else {
            panic!("{error:?}")
        };
        assert!(all.is_sorted() && all.len() >= 4, "{all:?}");
        assert_eq!(collider, "hammer");
        let is_between = place[0].abs() < 0.06 && place[1].abs() < 0.06 && place[2].abs() < 0.02;
        assert!(is_between, "{place:?}");
        assert_eq!(run.bodies, 0);
    }
}

#[test]
fn numbers_that_make_no_sense_are_refused() {
    let odd = |friction: f64| {
        let collider = Collider { friction, ..body("odd", block(), [0.0, 0.0, -0.1]) };
        held([collider]).build().unwrap_err()
    };
    for friction in [f64::NAN, f64::INFINITY, -0.1] {
        assert!(odd(friction).to_string().contains("friction of collider \"odd\""));
    }
    let contact = |friction: f64| held([]).self_contact(triangles(friction)).build().unwrap_err();
    assert!(contact(f64::NAN).to_string().contains("friction of the self-contact"));
    let mut cloth = sheet("thin", 3, 0.01, [0.0; 3]);
    let cloth_core::ClothMaterial::Springs(material) = &mut cloth.material else { unreachable!() };
    material.thickness = 0.0;
    let error = ModelBuilder::new().cloth(cloth).build().unwrap_err();
    assert!(error.to_string().contains("thickness of cloth \"thin\""), "{error}");
    let surface = || mesh(vec![[0.0; 3], [1.0, 0.0, 0.0], [f64::NAN; 3]], vec![[0, 1, 2]]);
    let error = held([body("odd", surface(), [0.0; 3])]).build().unwrap_err();
    assert!(error.to_string().contains("surface of collider \"odd\""), "{error}");
}

#[test]
fn surfaces_are_for_contact_of_triangles_alone() {
    let open = mesh(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    let builder = || held([body("open", open.clone(), [0.0, 0.0, -0.1])]);
    let error = builder().self_contact(points()).build().unwrap_err();
    assert!(matches!(&error, ModelError::BodyWithoutContact { collider } if collider == "open"));
    assert!(builder().build().unwrap().is_contact_body(0));
    let ball = body("ball", ColliderShape::Sphere { radius: 0.1 }, [0.0, 0.0, -0.2]);
    assert!(held([ball]).build().unwrap().is_contact_body(0));
    let floor = body("floor", ColliderShape::Plane, [0.0, 0.0, -0.2]);
    assert!(!held([floor]).build().unwrap().is_contact_body(0));
}

/// Twice the same vertices and triangles, one without area, one inside out, all through each other.
#[test]
fn a_body_may_be_as_odd_as_it_likes() {
    let corners = [[-0.05, -0.05, 0.0], [0.05, -0.05, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.03]];
    let positions = corners.into_iter().chain(corners).collect();
    let faces = vec![
        [0, 1, 2],
        [4, 5, 6],
        [2, 1, 0],
        [0, 5, 7],
        [1, 6, 3],
        [2, 4, 7],
        [0, 4, 1],
        [3, 3, 3],
    ];
    let model = build(held([body("odd", mesh(positions, faces), [0.0, 0.0, -0.05])]));
    let mut run = Run::new(&processor(2), &model, implicit(), Precision::F32);
    for frame in 1..=10 {
        run.frame(60.0, &[Pose::from_translation([0.0, 0.0, -0.05 + 0.004 * f64::from(frame)])])
            .unwrap();
    }
    assert!(run.contacts > 0);
    assert_eq!((run.bodies, run.cloths), (0, 0));
}

/// Ten thousand bodies of one triangle are a field of spikes; more than can be are refused.
#[test]
fn many_bodies_of_one_triangle() {
    let spike = Arc::new(BodySurface::rigid(
        vec![[-4e-4, 0.0, 0.0], [4e-4, 0.0, 0.0], [0.0, 0.0, 0.01]],
        vec![[0, 1, 2]],
    ));
    let at = |number: usize| {
        let [i, j] = [number % 100, number / 100].map(|k| 1.3e-3 * (k as f64 - 49.5));
        body(&format!("{number}"), ColliderShape::Surface(Arc::clone(&spike)), [i, j, -0.012])
    };
    let model = build(held((0..10_000).map(at)));
    let mut run = Run::new(&processor(2), &model, implicit(), Precision::F32);
    for _ in 0..6 {
        run.frame(60.0, &[]).unwrap();
    }
    assert!(run.contacts > 20, "{}", run.contacts);
    assert_eq!((run.bodies, run.cloths), (0, 0));
    let error = held((0..70_000).map(at)).build().unwrap_err();
    assert!(matches!(error, ModelError::TooMany { what: "colliders", .. }), "{error}");
}
