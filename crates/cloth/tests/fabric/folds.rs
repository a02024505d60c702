//! Fabric that is folded at rest comes to lie so.

use cloth::{
    Simulation, backend_create,
    scene::{CompileOptions, Scene},
};
use glam::DVec3;

/// Angle between the halves of a strip \[degrees\] after it was flat at first and free of forces: positive with the side inwards where triangles are seen
/// counterclockwise.
fn folded(angle: f64, frames: u64) -> f64 {
    let text = format!(
        r#"
        name = "strip"
        gravity = [0, 0, 0]
        simulation = {{ frames_per_second = 60, solver = "implicit" }}
        [[cloth]]
        material = {{ preset = "denim", damping = {{ bend = 0.05 }} }}
        geometry.grid = {{ columns = 17, rows = 5, spacing = 0.01 }}
        folds = [{{ lines = ["column-8"], angle = {angle} }}]
        "#
    );
    let scene = Scene::from_toml(&text, "strip.toml").unwrap();
    let scene = scene.compile(&CompileOptions::default()).unwrap();
    let mut simulation =
        Simulation::new(scene, backend_create("cpu", None).unwrap().as_ref()).unwrap();
    for _ in 0..frames {
        simulation.step().unwrap();
    }
    let x = simulation.state().unwrap().positions.clone();
    // Both halves along the middle row, from the fold to near it and to the ends: the strip around the fold is as bent as its triangles allow.
    let way = |from: usize, to: usize| DVec3::from(x[to]) - DVec3::from(x[from]);
    let [a, b] = [way(34 + 4, 34), way(34 + 12, 34 + 16)];
    // Nothing holds the strip, so that it may turn as a whole: up is where its triangles look.
    let across = way(8, 76);
    let up = b.cross(across) - a.cross(across);
    (-a).angle_between(b).to_degrees().copysign((a + b).dot(up))
}

#[test]
fn a_crease_takes_its_angle() {
    for angle in [45.0, -100.0] {
        let found = folded(angle, 600);
        assert!((found - angle).abs() < 1.0, "{found} degrees, not {angle}");
    }
    // The negative control: without a fold it stays flat.
    assert!(folded(0.0, 10).abs() < 0.1);
}
