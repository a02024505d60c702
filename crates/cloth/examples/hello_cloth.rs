//! A scene and its frames: `cargo run -p cloth --example hello_cloth`.

use std::error::Error;

use cloth::{
    Simulation, backend_create,
    scene::{CompileOptions, Scene},
};

/// A square of jersey falls onto a ball. `Scene::read` takes the same text from a file.
const SCENE: &str = r#"
name = "hello"

[simulation]
frames = 30
solver = "implicit"

[[cloth]]
name = "napkin"
geometry.grid = { columns = 31, rows = 31, spacing = 0.02, centre = [0, 0, 0.5] }
material.preset = "jersey"

[[collider]]
name = "ball"
shape.sphere.radius = 0.15
translation = [0, 0, 0.3]
friction = 0.3
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::from_toml(SCENE, "hello.toml")?.compile(&CompileOptions::default())?;
    let backend = backend_create("cpu", None)?;
    let mut simulation = Simulation::new(scene, backend.as_ref())?;
    while !simulation.is_finished() {
        let report = simulation.step()?;
        let strain = report.measures.strain_max;
        let heights = simulation.state()?.positions.iter().map(|position| position[2]);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        println!("frame {}: lowest point {lowest:.3} m, strain {strain:.3}", simulation.frame());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn it_runs() {
        super::main().expect("the example runs");
    }
}
