//! Sheets on and against bodies with edges and tips, audited in every frame.

use cloth_core::{
    BodySurface, ColliderShape, Model, ModelBuilder, Pose, Precision, contact::ContactKind,
    contact::Contacts,
};
use std::sync::Arc;

use crate::rig::{
    Run, body, border, build, explicit, implicit, mesh, points, processor, sheet, triangles,
};

/// A box much finer than the sheet that falls over it.
fn box_shape() -> ColliderShape {
    ColliderShape::Box { half_extents: [0.04, 0.045, 0.02] }
}

/// A steep tetrahedron whose tip points upwards.
fn spike() -> ColliderShape {
    let positions =
        vec![[-0.02, -0.015, 0.0], [0.02, -0.015, 0.0], [0.0, 0.025, 0.0], [0.0, 0.0, 0.07]];
    mesh(positions, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
}

/// A square without an inside, a little inclined.
fn leaf() -> ColliderShape {
    let positions =
        vec![[-0.05, -0.05, -0.004], [0.05, -0.05, 0.0], [0.05, 0.05, 0.004], [-0.05, 0.05, 0.0]];
    mesh(positions, vec![[0, 1, 2], [0, 2, 3]])
}

/// An upright fin: its upper edge is all there is to hold a sheet.
fn fin() -> ColliderShape {
    let positions =
        vec![[-0.06, 0.0, -0.04], [0.06, 0.0, -0.04], [0.06, 0.003, 0.04], [-0.06, 0.0, 0.04]];
    mesh(positions, vec![[0, 1, 2], [0, 2, 3]])
}

fn draped(contact: cloth_core::SelfContact, shape: ColliderShape, height: f64) -> Arc<Model> {
    let cloth = sheet("sheet", 15, 0.0153, [0.003, 0.002, height]);
    build(
        ModelBuilder::new()
            .cloth(cloth)
            .collider(body("body", shape, [0.0; 3]))
            .self_contact(contact),
    )
}

fn drapes(shape: &ColliderShape, height: f64) -> [Run; 2] {
    let model = draped(triangles(0.3), shape.clone(), height);
    [implicit(), explicit(&model)].map(|way| {
        let mut run = Run::new(&processor(2), &model, way, Precision::F32);
        for _ in 0..30 {
            run.frame(60.0, &[]).expect("frames can be computed");
        }
        assert_eq!((run.bodies, run.cloths), (0, 0));
        assert!(run.contacts > 0);
        run
    })
}

#[test]
fn a_box_does_not_go_through_a_sheet_that_hangs_over_it() {
    for mut run in drapes(&box_shape(), 0.03) {
        let mut contacts = Contacts::default();
        run.solver.contacts_read(&mut contacts).unwrap();
        let kinds: Vec<_> = contacts.contacts.iter().map(|contact| contact.key.kind).collect();
        assert!(kinds.contains(&ContactKind::EdgeEdge), "{kinds:?}");
        assert!(kinds.contains(&ContactKind::VertexFace), "{kinds:?}");
        // It lies on the box and hangs down beside it.
        let highest = run.state.positions.iter().fold(f64::NEG_INFINITY, |high, x| high.max(x[2]));
        assert!((0.02..0.026).contains(&highest), "{highest}");
        assert!(run.lowest() < 0.0, "{}", run.lowest());
    }
}

#[test]
fn a_spike_a_leaf_and_a_fin_hold_a_sheet() {
    for (shape, height) in [(spike(), 0.08), (leaf(), 0.02), (fin(), 0.05)] {
        for run in drapes(&shape, height) {
            let middle = run.state.positions[112];
            assert!(middle[2] > height - 0.045, "{shape:?}: it has gone through: {middle:?}");
        }
    }
}

/// With contact of points, and without the pairs with the body, the audit finds what passes.
#[test]
fn without_it_bodies_go_through() {
    let scenes = [(box_shape(), 0.03), (spike(), 0.08), (leaf(), 0.02), (fin(), 0.05)];
    for (shape, height) in scenes {
        let model = draped(triangles(0.3), shape.clone(), height);
        let cloth = sheet("sheet", 15, 0.0153, [0.003, 0.002, height]);
        let bare = build(ModelBuilder::new().cloth(cloth).self_contact(triangles(0.3)));
        let run = Run::new(&processor(2), &bare, implicit(), Precision::F32);
        let mut run = run.audited_as(&model);
        for _ in 0..12 {
            run.frame(60.0, &[]).unwrap();
        }
        assert!(run.bodies > 0, "{shape:?}");
    }
    let model = draped(points(), box_shape(), 0.03);
    let mut run = Run::new(&processor(2), &model, implicit(), Precision::F32);
    for _ in 0..30 {
        run.frame(60.0, &[]).unwrap();
    }
    assert!(run.bodies > 0, "edges of boxes go through where points touch");
}

/// A tip, turned as it goes, is driven into a sheet that is held at its border, and drawn back.
#[test]
fn a_body_that_moves_pushes_a_held_sheet() {
    let side = 13;
    for (shape, top) in [(spike(), 0.07), (fin(), 0.04), (box_shape(), 0.02)] {
        let mut cloth = sheet("sheet", side, 0.0153, [0.003, 0.002, 0.08]);
        cloth.pins = border(side);
        let builder =
            ModelBuilder::new().cloth(cloth).collider(body("body", shape, [0.0, 0.0, 0.075 - top]));
        let model = build(builder.self_contact(triangles(0.3)));
        for way in [implicit(), explicit(&model)] {
            let mut run = Run::new(&processor(2), &model, way, Precision::F32);
            let mut highest = 0.0_f64;
            for frame in 1..=24 {
                let share = f64::from(frame) / 12.0;
                let height = 0.075 - top + 0.03 * (1.0 - (1.0 - share).abs());
                let turn = 0.3 * share;
                let pose = Pose {
                    translation: [0.0, 0.0, height],
                    rotation: [0.0, 0.0, (0.5 * turn).sin(), (0.5 * turn).cos()],
                };
                run.frame(60.0, &[pose]).unwrap();
                highest = run.state.positions.iter().fold(highest, |high, x| high.max(x[2]));
            }
            assert_eq!((run.bodies, run.cloths), (0, 0));
            assert!(highest > 0.1, "{highest}");
            assert!(run.contacts > 0);
        }
    }
}

/// A surface that changes its shape: a roof that opens and lifts a sheet.
#[test]
fn a_surface_that_changes_its_shape_lifts_a_sheet() {
    let at = |open: f64| {
        vec![
            [-0.06, -0.06, 0.0],
            [-0.06, 0.06, 0.0],
            [0.0, -0.06, open],
            [0.0, 0.06, open],
            [0.06, -0.06, 0.0],
            [0.06, 0.06, 0.0],
        ]
    };
    let sets = (0..=4).map(|k| at(0.01 * f64::from(k))).collect();
    let triangles_of = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
    let surface = BodySurface { triangles: triangles_of, sets, rate: 10.0, start: 0.0 };
    let roof = ColliderShape::Surface(Arc::new(surface));
    let model = draped(triangles(0.5), roof, 0.004);
    for way in [implicit(), explicit(&model)] {
        let mut run = Run::new(&processor(2), &model, way, Precision::F32);
        for _ in 0..30 {
            run.frame(60.0, &[]).unwrap();
        }
        assert_eq!((run.bodies, run.cloths), (0, 0));
        let highest = run.state.positions.iter().fold(0.0_f64, |high, x| high.max(x[2]));
        assert!((0.04..0.046).contains(&highest), "{highest}");
    }
}
