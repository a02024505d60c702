//! Numbers and names of cloths, colliders, fields, air and contact.

use cloth_core::{
    Air, BendModel, Cloth, Collider, ColliderShape, ContactResponse, Field, Geometry, Gust, Mass,
    ModelBuilder, ModelError, NetworkSpring, Pose, SelfContact, SpringClass, SpringCoefficients,
    SpringNetwork,
};

use crate::{builder, grid_of, patch, springs};

/// What kind of error a bad number must give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    NonFinite,
    NotPositive,
    Negative,
    OutOfRange,
}

/// Asserts the kind of error, and that the message names the quantity.
#[track_caller]
fn assert_refused(builder: ModelBuilder, kind: Kind, quantity: &str) {
    let error = builder.build().expect_err(quantity);
    let (found, what) = match &error {
        ModelError::NonFinite { what, .. } => (Kind::NonFinite, what),
        ModelError::NotPositive { what, .. } => (Kind::NotPositive, what),
        ModelError::Negative { what, .. } => (Kind::Negative, what),
        ModelError::OutOfRange { what, .. } => (Kind::OutOfRange, what),
        _ => panic!("{quantity}: {error:?}"),
    };
    assert_eq!(found, kind, "{quantity}: {error}");
    assert!(what.contains(quantity), "{what:?} does not name {quantity:?}");
}

#[test]
fn numbers_of_a_cloth() {
    type Change = fn(&mut Cloth, f64);
    // Quantity, how to set it, and the error for zero and for a negative number.
    let quantities: [(&str, Change, Option<Kind>, Option<Kind>); 12] = [
        (
            "mass per particle",
            |cloth, value| springs(cloth).mass = Mass::PerParticle(value),
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "mass per area",
            |cloth, value| springs(cloth).mass = Mass::PerArea(value),
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "stretch stiffness",
            |cloth, value| springs(cloth).stretch.stiffness = value,
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "bend stiffness",
            |cloth, value| springs(cloth).bend.stiffness = value,
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "bend rigidity",
            |cloth, rigidity| {
                springs(cloth).bend_model = BendModel::ImmediateBuckling { rigidity };
            },
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "shear damping",
            |cloth, value| springs(cloth).shear.damping = value,
            None,
            Some(Kind::Negative),
        ),
        (
            "pressure coefficient",
            |cloth, value| springs(cloth).aerodynamics.pressure = value,
            None,
            Some(Kind::Negative),
        ),
        (
            "friction coefficient",
            |cloth, value| springs(cloth).aerodynamics.friction = value,
            None,
            Some(Kind::Negative),
        ),
        (
            "thickness",
            |cloth, value| springs(cloth).thickness = value,
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        (
            "spacing",
            |cloth, value| grid_of(cloth).spacing[1] = value,
            Some(Kind::NotPositive),
            Some(Kind::NotPositive),
        ),
        ("velocity", |cloth, value| cloth.velocity[2] = value, None, None),
        ("origin", |cloth, value| grid_of(cloth).origin[0] = value, None, None),
    ];
    for (quantity, change, zero, negative) in quantities {
        let with = |value| {
            let mut cloth = patch();
            change(&mut cloth, value);
            ModelBuilder::new().cloth(cloth)
        };
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_refused(with(value), Kind::NonFinite, quantity);
        }
        for (value, kind) in [(0.0, zero), (-1.0, negative)] {
            match kind {
                Some(kind) => assert_refused(with(value), kind, quantity),
                None => assert!(with(value).build().is_ok(), "{quantity} of {value}"),
            }
        }
    }
}

#[test]
fn a_cloth_without_cloth() {
    assert_eq!(ModelBuilder::new().build(), Err(ModelError::Empty));
    for (columns, rows) in [(1, 5), (5, 1), (0, 0)] {
        let mut cloth = patch();
        [grid_of(&mut cloth).columns, grid_of(&mut cloth).rows] = [columns, rows];
        let expected = ModelError::GridTooSmall { cloth: "patch".into(), columns, rows };
        assert_eq!(ModelBuilder::new().cloth(cloth).build(), Err(expected));
    }
}

#[test]
fn axes_of_a_grid() {
    let mut long = patch();
    grid_of(&mut long).column_axis = [2.0, 0.0, 0.0];
    assert_refused(ModelBuilder::new().cloth(long), Kind::OutOfRange, "column axis");
    let mut zero = patch();
    grid_of(&mut zero).row_axis = [0.0; 3];
    assert_refused(ModelBuilder::new().cloth(zero), Kind::OutOfRange, "row axis");
    let mut skew = patch();
    grid_of(&mut skew).row_axis = [0.6, 0.8, 0.0];
    assert_refused(ModelBuilder::new().cloth(skew), Kind::OutOfRange, "cosine");
}

#[test]
fn pins_of_a_cloth() {
    let mut cloth = patch();
    cloth.pins = vec![0, 9, 3];
    let expected =
        ModelError::PinOutOfRange { owner: "cloth \"patch\"".into(), pin: 9, particles: 9 };
    assert_eq!(ModelBuilder::new().cloth(cloth).build(), Err(expected));
}

#[test]
fn names_that_are_taken() {
    let error = builder().cloth(patch()).build();
    assert_eq!(error, Err(ModelError::NameTaken { what: "cloth", name: "patch".into() }));
    let error = builder().collider(collider()).collider(collider()).build();
    assert_eq!(error, Err(ModelError::NameTaken { what: "collider", name: "ball".into() }));
}

fn network(particles: [u32; 2], rest_length: Option<f64>) -> ModelBuilder {
    network_with(particles, rest_length, None)
}

fn network_with(
    particles: [u32; 2],
    rest_length: Option<f64>,
    coefficients: Option<SpringCoefficients>,
) -> ModelBuilder {
    let spring =
        NetworkSpring { particles, class: SpringClass::Stretch, rest_length, coefficients };
    let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
    let geometry = Geometry::Network(SpringNetwork { positions, springs: vec![spring] });
    ModelBuilder::new().cloth(Cloth { geometry, ..patch() })
}

#[test]
fn springs_of_a_network() {
    for rest_length in [0.0, -1.0] {
        assert_refused(network([0, 1], Some(rest_length)), Kind::NotPositive, "rest length");
    }
    assert_refused(network([0, 1], Some(f64::NAN)), Kind::NonFinite, "rest length");
    let with = |stiffness, damping| {
        network_with([0, 1], None, Some(SpringCoefficients { stiffness, damping }))
    };
    assert!(with(3.0, 0.0).build().is_ok());
    assert_refused(with(0.0, 0.0), Kind::NotPositive, "stiffness of a spring");
    assert_refused(with(f64::INFINITY, 0.0), Kind::NonFinite, "stiffness of a spring");
    assert_refused(with(1.0, -1.0), Kind::Negative, "damping of a spring");
    for [a, b] in [[1, 1], [2, 1]] {
        let error = network([a, b], None).build();
        let vertices = [a.min(b), a.max(b)];
        let expected = ModelError::SpringWithoutLength { cloth: "patch".into(), vertices };
        assert_eq!(error, Err(expected));
    }
    let error = network([0, 3], None).build();
    assert!(matches!(error, Err(ModelError::SpringOutOfRange { particle: 3, particles: 3, .. })));
    let empty = Geometry::Network(SpringNetwork::default());
    let error = ModelBuilder::new().cloth(Cloth { geometry: empty, ..patch() }).build();
    assert!(matches!(error, Err(ModelError::MeshEmpty { vertices: 0, .. })));
}

fn collider() -> Collider {
    Collider {
        name: "ball".into(),
        shape: ColliderShape::Sphere { radius: 1.0 },
        pose: Pose::IDENTITY,
        friction: 0.5,
        restitution: 0.5,
    }
}

#[test]
fn numbers_of_a_collider() {
    let capsule = |half_length, radius| ColliderShape::Capsule { half_length, radius };
    let turned = |rotation| Pose { rotation, ..Pose::IDENTITY };
    let cases = [
        (Collider { friction: -0.1, ..collider() }, Kind::Negative, "friction"),
        (Collider { friction: f64::NAN, ..collider() }, Kind::NonFinite, "friction"),
        (Collider { restitution: 1.1, ..collider() }, Kind::OutOfRange, "restitution"),
        (Collider { restitution: -0.1, ..collider() }, Kind::OutOfRange, "restitution"),
        (
            Collider { shape: ColliderShape::Sphere { radius: 0.0 }, ..collider() },
            Kind::NotPositive,
            "radius",
        ),
        (Collider { shape: capsule(-1.0, 1.0), ..collider() }, Kind::Negative, "half length"),
        (Collider { shape: capsule(1.0, -1.0), ..collider() }, Kind::NotPositive, "radius"),
        (
            Collider { shape: ColliderShape::Box { half_extents: [1.0, 0.0, 1.0] }, ..collider() },
            Kind::NotPositive,
            "half extent",
        ),
        (
            Collider { pose: Pose::from_translation([0.0, f64::NAN, 0.0]), ..collider() },
            Kind::NonFinite,
            "translation",
        ),
        (Collider { pose: turned([0.0; 4]), ..collider() }, Kind::OutOfRange, "quaternion"),
        (
            Collider { pose: turned([f64::NAN, 0.0, 0.0, 1.0]), ..collider() },
            Kind::NonFinite,
            "rotation",
        ),
    ];
    for (collider, kind, quantity) in cases {
        assert_refused(builder().collider(collider), kind, quantity);
    }
}

#[test]
fn numbers_of_the_surroundings() {
    let nan = f64::NAN;
    let gust = |amplitude, frequency| Air {
        gust: Some(Gust { amplitude, frequency }),
        ..Air::with_wind([0.0; 3])
    };
    let uniform = |acceleration| Field::Uniform { acceleration };
    let drag = |rate| Field::Drag { rate };
    let cases = [
        (builder().gravity([0.0, nan, 0.0]), Kind::NonFinite, "gravity"),
        (builder().field(uniform([nan; 3])), Kind::NonFinite, "acceleration of field 0"),
        (
            builder().field(drag([0.0; 3])).field(drag([0.0, -1.0, 0.0])),
            Kind::Negative,
            "drag rate of field 1",
        ),
        (
            builder().air(Air { density: -1.0, ..Air::with_wind([0.0; 3]) }),
            Kind::Negative,
            "density",
        ),
        (builder().air(Air::with_wind([nan; 3])), Kind::NonFinite, "wind"),
        (builder().air(gust(-1.0, 1.0)), Kind::Negative, "amplitude"),
        (builder().air(gust(1.0, nan)), Kind::NonFinite, "frequency"),
    ];
    for (builder, kind, quantity) in cases {
        assert_refused(builder, kind, quantity);
    }
}

#[test]
fn numbers_of_the_self_contact() {
    let impulse = |restitution, friction| ContactResponse::Impulse { restitution, friction };
    let penalty = |stiffness, damping| ContactResponse::Penalty { stiffness, damping };
    let triangles = |friction| ContactResponse::Triangles { friction };
    let cases = [
        (0.0, impulse(0.0, 0.0), Kind::NotPositive, "distance"),
        (-1.0, penalty(1.0, 0.0), Kind::NotPositive, "distance"),
        (f64::NAN, penalty(1.0, 0.0), Kind::NonFinite, "distance"),
        (0.1, impulse(1.5, 0.0), Kind::OutOfRange, "restitution"),
        (0.1, impulse(0.0, -0.1), Kind::Negative, "friction"),
        (0.1, penalty(0.0, 0.0), Kind::NotPositive, "stiffness"),
        (0.1, penalty(1.0, f64::INFINITY), Kind::NonFinite, "damping"),
        (0.0, triangles(0.3), Kind::NotPositive, "distance"),
        (0.1, triangles(-0.3), Kind::Negative, "friction"),
        (0.1, triangles(f64::NAN), Kind::NonFinite, "friction"),
    ];
    for (distance, response, kind, quantity) in cases {
        let contact = SelfContact { distance, response };
        assert_refused(builder().self_contact(contact), kind, quantity);
    }
}
