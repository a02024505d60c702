//! A model without a file: a flag in the wind beside a pole. `cargo run -p cloth --example model_in_code`.

use std::error::Error;

use cloth::{
    Air, Cloth, Collider, ColliderShape, Control, GridPatch, ImplicitSettings, Integrator,
    MaterialPreset, Model, ModelBuilder, ModelError, ModelSimulation, Pose, SolverConfig,
    backend_create,
};

const FRAMES_PER_SECOND: f64 = 60.0;
const COLUMNS: u32 = 31;
const ROWS: u32 = 21;

/// A flag of 60 x 40 cm that hangs upright, held at the pole, and air that moves along it.
fn flag() -> Result<Model, ModelError> {
    let patch = GridPatch::new([COLUMNS, ROWS], 0.02)
        .with_axes([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        .with_centre([0.32, 0.0, 1.5]);
    let pole_side = (0..ROWS).map(|row| patch.particle(0, row));
    let flag = Cloth::grid("flag", patch, &MaterialPreset::JET_SET).with_pins(pole_side);
    let pole = Collider {
        name: "pole".into(),
        shape: ColliderShape::Capsule { half_length: 0.9, radius: 0.01 },
        pose: Pose { translation: [0.0, 0.0, 0.9], ..Pose::default() },
        friction: 0.2,
        restitution: 0.0,
    };
    let air = Air::with_wind([4.0, 1.5, 0.0]);
    ModelBuilder::new().cloth(flag).collider(pole).air(air).build()
}

/// Height of the free lower corner of the flag after some frames, and how far it has moved out of the plane \[m\].
fn corner(frames: u32) -> Result<[f64; 2], Box<dyn Error>> {
    let config = SolverConfig {
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        time_step: 1.0 / 240.0,
        ..SolverConfig::default()
    };
    let backend = backend_create("cpu", None)?;
    let mut simulation =
        ModelSimulation::new(flag()?, &config, FRAMES_PER_SECOND, backend.as_ref())?;
    for _ in 0..frames {
        simulation.step(&Control::default())?;
    }
    let corner = simulation.state()?.positions[COLUMNS as usize - 1];
    Ok([corner[2], corner[1]])
}

fn main() -> Result<(), Box<dyn Error>> {
    let [height, sideways] = corner(30)?;
    println!(
        "after half a second the lower corner is at {height:.3} m, {sideways:.3} m out of the plane"
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_flag_flies() {
        let [height, sideways] = super::corner(12).expect("the example runs");
        assert!(height < 1.3 && sideways > 0.005, "it sinks to {height} m and blows {sideways} m");
    }
}
