//! A force of one's own: a magnet above a sheet pulls the particles that are near it, and moves. The force is computed from the
//! positions of each frame and goes in by the control. `cargo run -p cloth --example own_force`.
//!
//! Forces that a formula says are faster as a field in the model, which stays on the device: see `FieldProgram`.

use std::error::Error;

use cloth::{
    Cloth, Control, ForceControl, GridPatch, ImplicitSettings, Integrator, MaterialPreset,
    ModelBuilder, ModelSimulation, SolverConfig, backend_create,
};

const FRAMES_PER_SECOND: f64 = 60.0;
const SIDE: u32 = 21;

/// Where the magnet is after a time \[s\]: it goes along the sheet.
fn magnet(time: f64) -> [f64; 3] {
    [-0.2 + 0.4 * time, 0.0, 0.25]
}

/// A pull that falls with the square of the distance, on every particle of a state \[N\].
fn forces(positions: &[[f64; 3]], magnet: [f64; 3]) -> Vec<ForceControl> {
    (0..)
        .zip(positions)
        .map(|(particle, position)| {
            let away: [f64; 3] = std::array::from_fn(|k| magnet[k] - position[k]);
            let distance = away.iter().map(|x| x * x).sum::<f64>().sqrt().max(0.1);
            let pull = 2e-4 / distance.powi(3);
            ForceControl { particle, force: away.map(|x| pull * x), spring: None }
        })
        .collect()
}

/// Heights of all particles after some frames with a magnet, or without one \[m\].
fn heights(frames: u32, has_magnet: bool) -> Result<Vec<f64>, Box<dyn Error>> {
    let patch = GridPatch::new([SIDE, SIDE], 0.04);
    let corners = [[0, 0], [SIDE - 1, 0], [0, SIDE - 1], [SIDE - 1, SIDE - 1]];
    let sheet = Cloth::grid("sheet", patch, &MaterialPreset::JERSEY)
        .with_pins(corners.map(|[column, row]| patch.particle(column, row)));
    let model = ModelBuilder::new().cloth(sheet).build()?;
    let config = SolverConfig {
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        time_step: 1.0 / 120.0,
        ..SolverConfig::default()
    };
    let backend = backend_create("cpu", None)?;
    let mut simulation = ModelSimulation::new(model, &config, FRAMES_PER_SECOND, backend.as_ref())?;
    for frame in 0..frames {
        let mut control = Control::default();
        if has_magnet {
            let magnet = magnet(f64::from(frame) / FRAMES_PER_SECOND);
            control.forces = Some(forces(&simulation.state()?.positions, magnet));
        }
        simulation.step(&control)?;
    }
    Ok(simulation.state()?.positions.iter().map(|position| position[2]).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let [with, without] = [heights(60, true)?, heights(60, false)?];
    let lifted = with.iter().zip(&without).map(|(a, b)| a - b).fold(0.0, f64::max);
    println!("after a second the magnet has lifted the sheet by up to {lifted:.3} m");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_magnet_lifts_what_is_below_it() {
        let [with, without] = [true, false].map(|on| heights(12, on).expect("the example runs"));
        let lifted: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
        assert!(lifted.iter().copied().fold(0.0, f64::max) > 1e-3, "{lifted:?}");
        // The magnet is over the left half of the sheet.
        let [near, far] = [6, SIDE - 7].map(|column| lifted[(10 * SIDE + column) as usize]);
        assert!(near > 1.2 * far, "{near} m under the magnet, {far} m on the other side");
    }
}
