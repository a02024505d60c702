//! Energy of an undamped patch: a symplectic scheme lets it oscillate, never drift.

use cloth_core::{Frame, GridPatch, ModelBuilder};
use harness::{
    backends::candidates,
    models::{grid_cloth, material},
};

use crate::rig::{build, solver};

#[test]
fn the_energy_of_an_undamped_patch_does_not_drift() {
    let patch = GridPatch::horizontal(8, 0.1, 0.0);
    let cloth = grid_cloth("patch", patch, material(0.01, 50.0, 1e-3));
    let model = build(ModelBuilder::new().gravity([0.0; 3]).cloth(cloth));
    let time_step = 0.1 * model.stable_time_step();
    let mut start = model.initial_state();
    for x in &mut start.positions {
        *x = [1.1 * x[0], 1.02 * x[1], 0.05 * (7.0 * x[0]).sin()];
    }
    for candidate in candidates() {
        let mut solver = solver(candidate, &model, time_step);
        solver.upload(&start).unwrap();
        let energies: Vec<f64> = (0..500)
            .map(|_| {
                solver.advance(Frame { duration: 10.0 * time_step }).unwrap();
                solver.synchronize().unwrap().measures.energy()
            })
            .collect();
        let mean = |energies: &[f64]| energies.iter().sum::<f64>() / energies.len() as f64;
        let [first, last] = [mean(&energies[..100]), mean(&energies[400..])];
        // The scheme conserves exactly an energy that differs from the true one by at most
        // omega h / 2 = 0.1 of it, and whose mean deviation vanishes.
        let worst = energies.iter().map(|e| (e / first - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 0.1, "{}: relative deviation {worst}", candidate.label);
        let drift = (last / first - 1.0).abs();
        assert!(drift < 0.01, "{}: relative drift {drift}", candidate.label);
    }
}
