use super::{super::fabric_matrix::FabricMatrix, fabric::FabricAtStart};
use crate::{
    Air, Cloth, ContactResponse, Field, Geometry, GridPatch, Integrator, Mass, Material,
    MaterialPreset, Model, ModelBuilder, NetworkSpring, SelfContact, SemiImplicitSettings,
    SpringClass, SpringCoefficients, SpringNetwork, example::sheet,
};

const STIFFNESS: f64 = 50.0;
const MASS: f64 = 2e-3;

fn material(damping: f64) -> Material {
    let coefficients = SpringCoefficients { stiffness: STIFFNESS, damping };
    Material {
        mass: Mass::PerParticle(MASS),
        stretch: coefficients,
        shear: coefficients,
        bend: coefficients,
        ..MaterialPreset::ALL[0].material(0.1)
    }
}

fn cloth(geometry: Geometry, material: Material) -> Cloth {
    Cloth {
        name: "cloth".into(),
        geometry,
        material: material.into(),
        pins: vec![],
        velocity: [0.0; 3],
    }
}

fn chain(count: u32, damping: f64) -> Model {
    let network = SpringNetwork {
        positions: (0..count).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect(),
        springs: (1..count)
            .map(|i| NetworkSpring {
                particles: [i - 1, i],
                class: SpringClass::Stretch,
                rest_length: None,
                coefficients: None,
            })
            .collect(),
    };
    ModelBuilder::new().cloth(cloth(Geometry::Network(network), material(damping))).build().unwrap()
}

#[test]
fn a_chain_of_equal_masses_has_the_known_limit() {
    // omega_max of a free chain of n masses: 2 sqrt(k/m) sin(pi (n - 1) / (2 n)).
    let count = 12_u32;
    let n = f64::from(count);
    let omega =
        2.0 * (STIFFNESS / MASS).sqrt() * (std::f64::consts::FRAC_PI_2 * (n - 1.0) / n).sin();
    for damping in [0.0, 0.05, 5.0] {
        // Damping in proportion to stiffness: h^2 omega^2 + 2 h c = 4 for the fastest mode.
        let c = damping / STIFFNESS * omega * omega;
        let expected = 4.0 / (c + (c * c + 4.0 * omega * omega).sqrt());
        let model = chain(count, damping);
        for found in [model.stable_time_step(), model.stable_time_step_at_rest()] {
            let error = found / expected - 1.0;
            assert!((-1e-3..=1e-6).contains(&error), "damping {damping}: relative error {error}");
        }
    }
}

#[test]
fn a_model_without_forces_has_no_limit() {
    let model = chain(1, 0.0);
    assert_eq!(model.stable_time_step(), 1e3);
    assert_eq!(model.stable_time_step_at_rest(), 1e3);
}

/// One mass a thousandth of the others, somewhere in a large patch.
#[test]
fn a_single_light_particle_sets_the_limit() {
    let light = 1e-6_f64;
    let mut network = SpringNetwork::default();
    let patch = GridPatch::horizontal(60, 0.1, 0.0);
    for row in 0..60 {
        for column in 0..60 {
            network.positions.push(patch.position(column, row));
            let own = patch.particle(column, row);
            for (other, exists) in [(own + 1, column < 59), (own + 60, row < 59)] {
                if exists {
                    network.springs.push(NetworkSpring {
                        particles: [own, other],
                        class: SpringClass::Stretch,
                        rest_length: None,
                        coefficients: None,
                    });
                }
            }
        }
    }
    let mut model = ModelBuilder::new()
        .cloth(cloth(Geometry::Network(network), material(0.0)))
        .build()
        .unwrap();
    model.masses[1777] = light;
    // All four neighbours hardly move: omega^2 = 4 k / m in any shape, 2 k / m along an axis at rest.
    let expected = |count: f64| 2.0 / (count * STIFFNESS / light).sqrt();
    for (found, expected) in [
        (model.stable_time_step(), expected(4.0)),
        (model.stable_time_step_at_rest(), expected(2.0)),
    ] {
        let ratio = found / expected;
        assert!((0.97..=1.0).contains(&ratio), "{ratio}");
    }
}

#[test]
fn the_semi_implicit_integrator_is_limited_by_what_is_not_in_its_matrix() {
    let integrator = Integrator::SemiImplicit(SemiImplicitSettings::default());
    let patch = || {
        let geometry = Geometry::Grid(GridPatch::horizontal(8, 0.1, 0.0));
        ModelBuilder::new().cloth(cloth(geometry, material(0.1)))
    };
    let limit = |builder: ModelBuilder| builder.build().unwrap().stable_time_step_of(&integrator);
    assert_eq!(limit(patch()), None);
    let rate = 50.0;
    let drag = limit(patch().field(Field::Drag { rate: [0.0, rate, 0.0] })).unwrap();
    // 2 h r = 4.
    assert!((drag * rate / 2.0 - 1.0).abs() < 0.03, "{drag}");
    let penalty = |stiffness, damping| SelfContact {
        distance: 0.08,
        response: ContactResponse::Penalty { stiffness, damping },
    };
    let stiff = limit(patch().self_contact(penalty(1e4, 0.0))).unwrap();
    let soft = limit(patch().self_contact(penalty(1e2, 0.0))).unwrap();
    assert!((soft / stiff - 10.0).abs() < 1e-6, "{soft} {stiff}");
    assert!(limit(patch().self_contact(penalty(1e2, 1.0))).unwrap() < soft);
    assert!(limit(patch().air(Air::with_wind([30.0, 0.0, 0.0]))).is_some());
    let impulse = ContactResponse::Impulse { restitution: 0.0, friction: 0.5 };
    let impulses = patch().self_contact(SelfContact { distance: 0.08, response: impulse });
    assert_eq!(limit(impulses), None);
    let implicit = Integrator::Implicit(crate::ImplicitSettings::default());
    let model = patch().self_contact(penalty(1e4, 0.0)).build().unwrap();
    assert_eq!(model.stable_time_step_of(&implicit), None);
    assert_eq!(model.stable_time_step_of(&Integrator::Explicit), Some(model.stable_time_step()));
}

/// x (h^2 K + 2 h C) x of the fabric of a model in the shape that its particles are in.
fn of_shape(fabric: &FabricAtStart<'_>, h: f64, x: &[[f64; 3]], y: &mut [[f64; 3]]) -> f64 {
    y.fill([0.0; 3]);
    fabric.add(
        h,
        |particle| x[particle as usize],
        |particle, add| {
            let y = &mut y[particle as usize];
            (0..3).for_each(|k| y[k] += add[k]);
        },
    );
    x.as_flattened().iter().zip(y.as_flattened()).map(|(x, y)| x * y).sum()
}

/// The constant matrix of the semi-implicit integrator is at least half of that of any shape, in the directions in which it is stiffest
/// too (NUMERICS §6).
#[test]
fn the_constant_matrix_is_at_least_half_of_that_of_any_shape() {
    let model = sheet(7, f64::INFINITY);
    let constant = FabricMatrix::constant(&model);
    let (h, rest) = (0.01, model.positions().to_vec());
    let quadratic = |x: &[[f64; 3]]| -> f64 {
        let row = |i: usize, k: usize| -> f64 {
            let entries =
                constant.neighbours().row(i).iter().zip(&constant.entries()[constant.row(i)]);
            let others = entries.map(|(&j, entry)| entry.at(h) * x[j as usize][k]);
            constant.own()[i].at(h) * x[i][k] + others.sum::<f64>()
        };
        (0..x.len()).map(|i| (0..3).map(|k| x[i][k] * row(i, k)).sum::<f64>()).sum()
    };
    let moved = |amount: f64| -> Vec<[f64; 3]> {
        let bent = |&[x, y, z]: &[f64; 3]| {
            [x + amount * (9.0 * y).sin(), y + amount * x, z + amount * (40.0 * x).sin()]
        };
        rest.iter().map(bent).collect()
    };
    let mut largest: f64 = 0.0;
    for amount in [0.0, 0.002, 0.005, 0.01] {
        let fabric = FabricAtStart::new(model.elements(), &moved(amount));
        let mut x: Vec<[f64; 3]> =
            (0..rest.len()).map(|i| [0, 1, 2].map(|k| ((7 * i + 3 * k) as f64).sin())).collect();
        let mut y = x.clone();
        for _ in 0..60 {
            let ratio = of_shape(&fabric, h, &x, &mut y) / quadratic(&x);
            assert!(ratio <= 2.0 + 1e-9, "{amount}: {ratio}");
            largest = largest.max(ratio);
            let length = y.as_flattened().iter().map(|y| y * y).sum::<f64>().sqrt();
            x.iter_mut().zip(&y).for_each(|(x, y)| *x = y.map(|y| y / length));
        }
    }
    assert!(largest > 0.1, "far above what it has to be: {largest}");
}

#[test]
fn translations_have_no_stiffness() {
    let model = sheet(7, f64::INFINITY);
    let constant = FabricMatrix::constant(&model);
    for (i, own) in constant.own().iter().enumerate() {
        let sum: f64 =
            constant.entries()[constant.row(i)].iter().map(|entry| entry.stiffness).sum();
        assert!((own.stiffness + sum).abs() < 1e-9 * own.stiffness, "{i}");
    }
}
