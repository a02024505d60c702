//! The workload by which the engine is compared with others, at any size.

use crate::{
    Scene, SceneBend, SceneCloth, SceneCollider, SceneContact, SceneContactResponse, SceneField,
    SceneGeometry, SceneGrid, SceneMass, SceneMaterial, ScenePin, SceneSemiImplicit, SceneShape,
    SceneSimulation, SceneSpring,
};

/// What happens to the patch of a benchmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchKind {
    /// It hangs from particles 0 and N - 1, the corners of row 0.
    Hang,
    /// It falls on a sphere with a radius of a quarter of its side.
    Sphere,
}

/// Distance of neighbouring particles \[m\]: the side grows with the count, so that the stable time
/// step does not depend on it.
const SPACING: f64 = 0.02;

/// Distance of contact, of cloth with itself and (as its thickness, so at half of it) with the
/// sphere \[m\].
const CONTACT_DISTANCE: f64 = 0.8 * SPACING;

/// The benchmark with `particles_per_side` squared particles, with or without self-contact. At 160
/// and with contact it is the built-in scene `bench-hang` or `bench-sphere`.
#[must_use]
pub fn bench_scene(kind: BenchKind, particles_per_side: u32, contact: bool) -> Scene {
    let side = f64::from(particles_per_side.saturating_sub(1)) * SPACING;
    let spring = |stiffness| Some(SceneSpring { stiffness: Some(stiffness), damping: Some(0.005) });
    let mut scene = Scene::new(match kind {
        BenchKind::Hang => "bench-hang",
        BenchKind::Sphere => "bench-sphere",
    });
    scene.simulation = SceneSimulation {
        frames: 70,
        frames_per_second: 60.0,
        // 17 substeps of each frame.
        time_step: Some(1.0 / 1020.0),
        // A hanging patch of this size stretches to 28 times its length: no fabric, but the same
        // work for every engine.
        strain_bound: 1000.0,
        // With the default a small patch gets through the sphere.
        semi_implicit: SceneSemiImplicit {
            time_step: Some(1.0 / 120.0),
            ..SceneSemiImplicit::default()
        },
        ..SceneSimulation::default()
    };
    scene.cloths.push(SceneCloth {
        name: "patch".into(),
        model: None,
        velocity: [0.0; 3],
        colour: None,
        pins: match kind {
            BenchKind::Hang => vec![ScenePin::from("bottom-left"), ScenePin::from("bottom-right")],
            BenchKind::Sphere => Vec::new(),
        },
        geometry: SceneGeometry::Grid(SceneGrid {
            origin: Some([0.0; 3]),
            ..SceneGrid::new(particles_per_side, particles_per_side, SPACING)
        }),
        pattern: None,
        inflate: None,
        tear: None,
        layer: None,
        folds: Vec::new(),
        material: SceneMaterial {
            thickness: Some(CONTACT_DISTANCE),
            mass: Some(SceneMass::PerParticle(1e-4)),
            stretch: spring(10.0),
            shear: spring(10.0),
            bend: Some(SceneBend { stiffness: Some(2.0), damping: Some(0.005), rigidity: None }),
            ..SceneMaterial::default()
        },
    });
    scene.fields.push(SceneField::Drag { rate: [0.5; 3] });
    if kind == BenchKind::Sphere {
        let radius = 0.25 * side;
        scene.colliders.push(SceneCollider {
            name: "ball".into(),
            shape: SceneShape::Sphere { radius },
            translation: [0.5 * side, 0.5 * side, -(radius + 0.5 * SPACING)],
            rotation: None,
            friction: 0.3,
            restitution: 0.0,
            colour: None,
            hidden: false,
            motion: Vec::new(),
        });
    }
    if contact {
        scene.contact = Some(SceneContact {
            distance: Some(CONTACT_DISTANCE),
            response: SceneContactResponse::Penalty { stiffness: 10.0, damping: 0.002 },
            ..SceneContact::default()
        });
    }
    scene
}
