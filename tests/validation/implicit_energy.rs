//! Backward Euler loses energy, never gains it.

use cloth_core::{Frame, GridPatch, ModelBuilder};
use harness::{
    backends::candidates_with,
    feature::Feature,
    models::{grid_cloth, material},
};

use crate::rig::{build, implicit, solver_of};

/// A cloth that hangs from two corners and swings from there, without any other force.
#[test]
fn the_energy_of_a_hanging_cloth_never_grows() {
    let mut fabric = material(1e-3, 50.0, 1e-3);
    fabric.stretch.damping = 0.005;
    let mut cloth = grid_cloth("patch", GridPatch::horizontal(8, 0.1, 0.0), fabric);
    cloth.pins = vec![0, 7];
    let model = build(ModelBuilder::new().cloth(cloth));
    for candidate in candidates_with(Feature::Implicit) {
        for time_step in [1e-3, 1.0 / 240.0, 1.0 / 120.0, 1.0 / 60.0, 1.0 / 30.0] {
            let mut solver = solver_of(candidate, &model, time_step, implicit(candidate, 1e-6));
            let mut before = f64::INFINITY;
            let steps = candidate.work((1.5 / time_step) as u32);
            for step in 0..steps {
                solver.advance(Frame { duration: time_step }).unwrap();
                let measures = solver.synchronize().unwrap().measures;
                let energy = measures.energy();
                // Rounding of what the energy is summed up from, of the order of a joule.
                let rounding = 1e-6_f64.max(50.0 * candidate.epsilon());
                assert!(
                    energy <= before + rounding,
                    "{} h {time_step}: {before} to {energy} in step {step}, strain {}",
                    candidate.label,
                    measures.strain_max
                );
                before = energy;
            }
        }
    }
}
