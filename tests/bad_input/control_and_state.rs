//! Controls and states that do not fit their model.

use cloth_core::{
    Collider, ColliderControl, ColliderShape, Control, Model, ModelError, PinAction, PinControl,
    Pose, State,
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
    for action in [PinAction::Hold, PinAction::Release, PinAction::MoveTo([0.0; 3])] {
        assert_eq!(pin(9, action).validate(&model), Err(expected.clone()));
        assert_eq!(pin(8, action).validate(&model), Ok(()));
    }
    let error = pin(4, PinAction::MoveTo([0.0, f64::NAN, 0.0])).validate(&model);
    assert!(
        matches!(&error, Err(ModelError::NonFinite { what, .. }) if what.contains("pin 4")),
        "{error:?}"
    );
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
