//! Controls and states that do not fit their model.

use cloth_core::{
    Anchor, AnchorSpring, Collider, ColliderControl, ColliderShape, Control, ForceControl, Model,
    ModelError, PinAction, PinControl, Pose, State,
};

use crate::builder;

fn model() -> Model {
    let plane = Collider {
        name: "plane".into(),
        shape: ColliderShape::Plane,
        pose: Pose::IDENTITY,
        friction: 0.0,
        restitution: 0.0,
    };
    builder().collider(plane).build().unwrap()
}

fn pin(particle: u32, action: PinAction) -> Control {
    Control { pins: vec![PinControl { particle, action }], ..Control::default() }
}

#[test]
fn indices_and_numbers_of_a_control() {
    let model = model();
    let expected = ModelError::PinOutOfRange { owner: "control".into(), pin: 9, particles: 9 };
    let moves = [PinAction::MoveTo, PinAction::MoveBy].map(|of| of([0.0; 3]));
    for action in [PinAction::Hold, PinAction::Release].into_iter().chain(moves) {
        assert_eq!(pin(9, action).validate(&model), Err(expected.clone()));
        assert_eq!(pin(8, action).validate(&model), Ok(()));
    }
    for of in [PinAction::MoveTo, PinAction::MoveBy] {
        let error = pin(4, of([0.0, f64::NAN, 0.0])).validate(&model);
        assert!(
            matches!(&error, Err(ModelError::NonFinite { what, .. }) if what.contains("pin 4")),
            "{error:?}"
        );
    }
    let collider = |collider, pose| Control {
        colliders: vec![ColliderControl { collider, pose }],
        ..Control::default()
    };
    let error = collider(1, Pose::IDENTITY).validate(&model);
    assert!(
        matches!(error, Err(ModelError::OutOfRange { value, max, .. }) if (value, max) == (1.0, 0.0)),
        "{error:?}"
    );
    let pose = Pose { rotation: [0.0, 0.0, 0.0, 2.0], ..Pose::IDENTITY };
    let error = collider(0, pose).validate(&model);
    assert!(matches!(error, Err(ModelError::OutOfRange { value: 2.0, .. })), "{error:?}");
    let wind = Control { wind_velocity: Some([f64::NAN; 3]), ..Control::default() };
    assert!(matches!(wind.validate(&model), Err(ModelError::NonFinite { .. })));
}

#[test]
fn forces_of_a_control() {
    let model = model();
    let forces =
        |force| Control { forces: Some(vec![force]), ..Control::default() }.validate(&model);
    let spring =
        AnchorSpring { anchor: Anchor::Here, stiffness: 0.0, damping: 0.0, reach: f64::INFINITY };
    let good = ForceControl { particle: 8, force: [0.0; 3], spring: Some(spring) };
    assert_eq!(forces(good), Ok(()));
    let expected = ModelError::ForceOutOfRange { particle: 9, particles: 9 };
    assert_eq!(forces(ForceControl { particle: 9, ..good }), Err(expected));
    let error = forces(ForceControl { force: [0.0, f64::INFINITY, 0.0], ..good });
    assert!(
        matches!(&error, Err(ModelError::NonFinite { what, .. }) if what.contains("particle 8"))
    );
    type Change = fn(&mut AnchorSpring);
    let cases: [(&str, Change); 4] = [
        ("stiffness", |spring| spring.stiffness = -1.0),
        ("damping", |spring| spring.damping = -1e-9),
        ("reach", |spring| spring.reach = -0.5),
        ("reach", |spring| spring.reach = f64::NEG_INFINITY),
    ];
    for (name, change) in cases {
        let mut spring = spring;
        change(&mut spring);
        match forces(ForceControl { spring: Some(spring), ..good }) {
            Err(ModelError::Negative { what, .. } | ModelError::NonFinite { what, .. }) => {
                assert!(what.starts_with(name), "{what}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    let cases: [Change; 4] = [
        |spring| spring.stiffness = f64::INFINITY,
        |spring| spring.damping = f64::NAN,
        |spring| spring.reach = f64::NAN,
        |spring| spring.anchor = Anchor::At([0.0, f64::NAN, 0.0]),
    ];
    for change in cases {
        let mut spring = spring;
        change(&mut spring);
        let error = forces(ForceControl { spring: Some(spring), ..good });
        assert!(matches!(error, Err(ModelError::NonFinite { .. })), "{error:?}");
    }
    let offset = Control { anchor_offset: Some([f64::NAN; 3]), ..Control::default() };
    assert!(matches!(offset.validate(&model), Err(ModelError::NonFinite { .. })));
}

#[test]
fn lengths_of_a_state() {
    type Change = fn(&mut State);
    let model = model();
    let cases: [(&str, Change, usize, usize); 4] = [
        ("state.positions", |state| _ = state.positions.pop(), 8, 9),
        ("state.velocities", |state| state.velocities.push([0.0; 3]), 10, 9),
        ("state.held", |state| state.held.clear(), 0, 9),
        ("state.colliders", |state| state.colliders.clear(), 0, 1),
    ];
    for (what, change, found, expected) in cases {
        let mut state = model.initial_state();
        change(&mut state);
        let expected = ModelError::LengthMismatch { what, found, expected };
        assert_eq!(state.validate(&model), Err(expected));
    }
    assert_eq!(model.initial_state().validate(&model), Ok(()));
}

#[test]
fn numbers_of_a_state() {
    type Change = fn(&mut State);
    let model = model();
    let cases: [(&str, Change); 4] = [
        ("state.time", |state| state.time = f64::NAN),
        ("position of particle 5", |state| state.positions[5][1] = f64::INFINITY),
        ("velocity of particle 7", |state| state.velocities[7][0] = f64::NAN),
        ("collider 0", |state| state.colliders[0].translation[2] = f64::NAN),
    ];
    for (quantity, change) in cases {
        let mut state = model.initial_state();
        change(&mut state);
        let error = state.validate(&model);
        assert!(
            matches!(&error, Err(ModelError::NonFinite { what, .. }) if what.contains(quantity)),
            "{quantity}: {error:?}"
        );
    }
}
