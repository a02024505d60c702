//! Rigid bodies that press cloth against what does not give way are stopped by it.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use cloth::{
    SceneAudit, Simulation, backend_create,
    scene::{CompileOptions, Scene},
};

/// A weight \[kg\] that falls some millimetres onto a mat on a table. What it sways after that, by a millimetre on what it sticks to, dies away within a second.
fn scene(mass: f64) -> String {
    format!(
        r#"
name = "weight"
simulation = {{ frames = 30, frames_per_second = 30 }}
[[cloth]]
name = "mat"
material.preset = "denim"
geometry.grid = {{ columns = 13, rows = 13, spacing = 0.015, centre = [0, 0, 0.102] }}
[contact]
[[collider]]
name = "table"
shape.box.half_extents = [0.2, 0.2, 0.05]
translation = [0, 0, 0.05]
[[rigid]]
name = "weight"
shape.box.half_extents = [0.05, 0.05, 0.05]
mass = {mass}
translation = [0, 0, 0.156]
"#
    )
}

/// Each of them once ended the run: the cloth below was pinched. With wgpu if `CLOTH_TEST_FULL` is set: a processor that stands for a GPU takes minutes.
#[test]
fn a_weight_on_cloth_comes_to_rest() {
    let is_full = std::env::var_os("CLOTH_TEST_FULL").is_some();
    for name in ["cpu", "cuda", "wgpu"].into_iter().filter(|&name| is_full || name != "wgpu") {
        let backend = match backend_create(name, None) {
            Ok(backend) => backend,
            Err(error) => {
                println!("not run here: {name}: {error}");
                continue;
            }
        };
        let masses = if name == "cpu" { &[1.0, 10.0][..] } else { &[10.0] };
        for mass in masses {
            let scene = Scene::from_toml(&scene(*mass), "weight.toml").unwrap();
            let scene = scene.compile(&CompileOptions::default()).unwrap();
            let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
            let audit = SceneAudit::new(simulation.model());
            while !simulation.is_finished() {
                simulation.step().unwrap();
                let found = simulation.intersections(&audit).unwrap();
                assert_eq!(found.pairs(), 0, "{name} {mass} kg: {found:?}");
            }
            let motion = simulation.rigid().unwrap().motions()[0];
            let [height, upright] = [motion.pose.translation[2], motion.pose.rotation[3]];
            assert!((0.15..0.155).contains(&height), "{name} {mass} kg: at {height} m");
            assert!(upright.abs() > 0.9999, "{name} {mass} kg: {:?}", motion.pose);
            let speed = motion.velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!(speed < 0.02, "{name} {mass} kg: {speed} m/s");
        }
    }
}
