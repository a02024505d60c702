//! Meshes with triangles of all shapes take about as many iterations as regular ones.

use std::fmt::Write;

use cloth::{
    Preconditioner, Simulation, StepReport, backend_create,
    scene::{CompileOptions, Scene},
};
use tempfile::TempDir;

const SPACING: f64 = 0.005;

/// A square sheet in the plane z = 0, whose inner vertices lie up to a fifth of the spacing beside those of a grid, with diagonals either way.
fn sheet(side: u32) -> String {
    let mut state = 7_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1_u32 << 24) - 0.5
    };
    let mut text = String::new();
    for row in 0..side {
        for column in 0..side {
            let is_inner = |k: u32| (1..side - 1).contains(&k);
            let jitter = if is_inner(row) && is_inner(column) { 0.4 * SPACING } else { 0.0 };
            let at = [column, row].map(|k| SPACING * f64::from(k) + jitter * random());
            writeln!(text, "v {0} {1} 0\nvt {0} {1}", at[0], at[1]).unwrap();
        }
    }
    for row in 0..side - 1 {
        for column in 0..side - 1 {
            let a = row * side + column + 1;
            let [b, c, d] = [a + 1, a + side, a + side + 1];
            let halves =
                if random() > 0.0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
            for [i, j, k] in halves {
                writeln!(text, "f {i}/{i} {j}/{j} {k}/{k}").unwrap();
            }
        }
    }
    text
}

/// The reports of the frames of a cotton sheet of so many vertices squared.
fn reports(side: u32, frames: u32, rest: &str) -> Vec<StepReport> {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("sheet.obj"), sheet(side)).unwrap();
    let path = folder.path().join("sheet.toml");
    let text = format!(
        "simulation = {{ frames = {frames}, solver = 'implicit' }}\n[[cloth]]\nmaterial.preset = 'cotton'\n\
         geometry.mesh = {{ file = 'sheet.obj' }}\n{rest}"
    );
    std::fs::write(&path, text).unwrap();
    let scene = Scene::read(&path).unwrap().compile(&CompileOptions::default()).unwrap();
    let backend = backend_create("cpu", None).unwrap();
    let mut simulation = Simulation::new(scene, backend.as_ref()).unwrap();
    (0..frames).map(|_| simulation.step().unwrap().clone()).collect()
}

/// Hundreds of iterations a solve, and hardly converged: a solver of a few neighbours at a time had to find out that all falls alike, and single
/// precision lost the mass in the stiffness.
#[test]
fn a_free_fall_takes_few_iterations() {
    let reports = reports(50, 4, "");
    // 1/2 m g^2 of v = g t.
    let share = |report: &StepReport| report.measures.energy_kinetic / report.time.powi(2);
    for report in &reports {
        let solver = &report.solver;
        assert_eq!(solver.solves_unconverged, 0);
        let each = solver.iterations as f64 / f64::from(solver.solves);
        assert!(each < 60.0, "{each} iterations a solve");
        let changed = share(report) / share(&reports[0]) - 1.0;
        assert!(changed.abs() < 1e-3, "{changed} faster or slower than a fall");
    }
}

/// What hangs in folds is stiff: `block` is given up in the middle of a solve, and `schwarz` goes on to the tolerance.
#[test]
fn auto_goes_on_with_schwarz_where_block_takes_too_many_iterations() {
    let side = 66;
    let reports = reports(side, 3, &format!("pins = [0, {}]", side - 1));
    let solver = &reports.last().unwrap().solver;
    assert_eq!(solver.preconditioner, Some(Preconditioner::Schwarz));
    assert_eq!(solver.solves_unconverged, 0);
    let each = solver.iterations as f64 / f64::from(solver.solves);
    assert!(each < 200.0, "{each} iterations a solve");
}
