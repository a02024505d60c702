//! Gas under pressure in a closed cloth, against the thin shell.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::collections::HashMap;

use cloth::{
    Backend, Cloth, Control, Field, ImplicitSettings, Inflation, Integrator, Model, ModelBuilder,
    ModelSimulation, Precision, RestSource, SolverConfig, TriangleMesh, backend_create,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
};

const RADIUS: f64 = 0.1;
const PRESSURE: f64 = 500.0;
/// Stiffness along a thread and across \[N/m\].
const STIFFNESS: [f64; 2] = [300.0, 90.0];

/// An icosahedron whose triangles are divided `times` times, on a sphere.
fn sphere(times: u32) -> TriangleMesh {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut positions: Vec<[f64; 3]> = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        positions.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    // Vertices 2 apart are neighbours.
    let near = |a: usize, b: usize| distance(positions[a], positions[b]) < 4.1;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let [p, q, r] = [a, b, c].map(|i| positions[i]);
                    let [u, v] = [q, r].map(|s| [s[0] - p[0], s[1] - p[1], s[2] - p[2]]);
                    let normal = [
                        u[1] * v[2] - u[2] * v[1],
                        u[2] * v[0] - u[0] * v[2],
                        u[0] * v[1] - u[1] * v[0],
                    ];
                    let out: f64 = (0..3).map(|k| normal[k] * p[k]).sum();
                    let [a, b, c] = [a, b, c].map(|i| i as u32);
                    triangles.push(if out > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..times {
        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [d, e, f] = [[a, b], [b, c], [c, a]].map(|[i, j]| {
                *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                    let [p, q] = [i, j].map(|i| positions[i as usize]);
                    positions.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
        }
        triangles = finer;
    }
    for position in &mut positions {
        let length = position.iter().map(|x| x * x).sum::<f64>().sqrt();
        *position = position.map(|x| RADIUS * x / length);
    }
    TriangleMesh { positions, triangles, ..TriangleMesh::default() }
}

fn model() -> Model {
    let [along, across] = STIFFNESS;
    let fabric = Fabric {
        area_density: 0.2,
        thickness: 1e-3,
        warp: TensileCurve::linear(along),
        weft: TensileCurve::linear(along),
        coupling: across,
        shear: 0.5 * (along - across),
        bending: BendingRigidity::isotropic(1e-7),
        friction: InternalFriction::default(),
        damping: [2e-4, 1e-3],
        stretch_limit: f64::INFINITY,
    };
    let rest = RestSource::Start { warp: Some([0.3, 0.5, 0.8]) };
    let rise = [0.0, 0.1];
    ModelBuilder::new()
        .gravity([0.0; 3])
        .cloth(Cloth::fabric_mesh("balloon", sphere(3), fabric, rest))
        .inflation(Inflation { cloth: "balloon".into(), pressure: PRESSURE, rise })
        .field(Field::Drag { rate: [20.0; 3] })
        .build()
        .unwrap()
}

/// Stretch of a thin sphere: with S = (C11 + C12) E and E = (l^2 - 1) / 2, virtual work gives p = 2 S / (R l).
fn stretch() -> f64 {
    let pressure = |l: f64| (STIFFNESS[0] + STIFFNESS[1]) * (l * l - 1.0) / (RADIUS * l);
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pressure(middle) < PRESSURE { low = middle } else { high = middle }
    }
    low
}

fn sphere_reaches_its_radius(
    backend: &dyn Backend,
    (integrator, time_step): (Integrator, f64),
    precision: Precision,
) {
    let config = SolverConfig { integrator, time_step, precision, ..SolverConfig::default() };
    let mut simulation = ModelSimulation::new(model(), &config, 50.0, backend).unwrap();
    for _ in 0..50 {
        simulation.step(&Control::default()).unwrap();
    }
    let positions = &simulation.state().unwrap().positions;
    let radii = positions.iter().map(|x| x.iter().map(|x| x * x).sum::<f64>().sqrt());
    let found = radii.sum::<f64>() / positions.len() as f64 / RADIUS;
    let expected = stretch();
    assert!((found / expected - 1.0).abs() < 0.02, "{found}, {expected}");
    // Which is no small part of how much it stretches.
    assert!(((found - 1.0) / (expected - 1.0) - 1.0).abs() < 0.06, "{found}, {expected}");
    let sums: [f64; 3] = std::array::from_fn(|k| positions.iter().map(|x| x[k]).sum());
    // Of a hundred places of some 0.1 m, a thousand times in steps.
    let rounding = if precision == Precision::F64 { 1e-6 } else { 1e-3 };
    assert!(
        sums.iter().all(|sum| sum.abs() < rounding),
        "a closed cloth does not push itself: {sums:?}"
    );
}

fn implicit() -> (Integrator, f64) {
    (Integrator::Implicit(ImplicitSettings::default()), 5e-3)
}

#[test]
fn a_sphere_reaches_the_radius_of_a_thin_shell() {
    let explicit = (Integrator::Explicit, 5e-5);
    for (backend, integrator) in [("cpu", explicit), ("cpu", implicit()), ("reference", implicit())]
    {
        let backend = backend_create(backend, None).unwrap();
        sphere_reaches_its_radius(backend.as_ref(), integrator, Precision::F64);
    }
}

#[test]
fn a_sphere_reaches_it_on_gpus() {
    for name in ["wgpu", "cuda"] {
        match backend_create(name, None) {
            Ok(backend) => sphere_reaches_its_radius(backend.as_ref(), implicit(), Precision::F32),
            Err(error) => println!("not run here: {name}: {error}"),
        }
    }
}

#[test]
fn gas_of_no_cloth_is_refused() {
    let cloth = |name: &str| {
        ModelBuilder::new()
            .cloth(Cloth::fabric_mesh(
                "balloon",
                sphere(0),
                model().elements().fabrics()[0],
                RestSource::Start { warp: Some([0.3, 0.5, 0.8]) },
            ))
            .inflation(Inflation { cloth: name.into(), pressure: 1.0, rise: [0.0, 0.0] })
            .build()
    };
    let error = cloth("baloon").unwrap_err().to_string();
    assert!(error.contains("baloon") && error.contains("name one"), "{error}");
}
