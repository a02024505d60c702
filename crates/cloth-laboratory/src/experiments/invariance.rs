//! What a fabric must not feel, and what it must feel everywhere alike.

use cloth_core::Result;

use super::{Experiment, TIGHT, meshes, poplin};
use crate::{Flaw, Laboratory, Outcome, meshes::Strip, theory::membrane};

pub(super) const RIGID_MOTION: Experiment = Experiment {
    name: "rigid-motion",
    title: "A piece is turned and shifted: the largest force on a particle, relative to that of a stretch by 1 %",
    source: "no force, but for the rounding of positions",
    control: Flaw { fabric: None, pattern_growth: 1e-3, is_damped: false, slipperiness: 0.0 },
    run: rigid_motion,
};

pub(super) const PATCH_TEST: Experiment = Experiment {
    name: "patch-test",
    title: "A piece is held at its border in a shape of constant strain: the largest force on a particle within, relative to that at the border, \
            and the mean stress",
    source: "no force within, but for rounding; the stress of the law",
    control: TIGHT,
    run: patch_test,
};

/// Length and width of the piece \[m\].
const SIZE: [f64; 2] = [0.1, 0.06];

fn largest(forces: &[[f64; 3]]) -> f64 {
    forces.iter().flatten().fold(0.0, |m: f64, f| if f.is_nan() { *f } else { m.max(f.abs()) })
}

fn strip(kind: crate::MeshKind, cells: u32) -> Strip {
    let [length, width] = SIZE;
    Strip { length, width, cells: [cells, cells * 3 / 5], kind, angle: 0.3 }
}

fn rigid_motion(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for (kind, cells) in meshes(laboratory, [10, 20]) {
        let model = laboratory.model(strip(kind, cells).mesh(), poplin(), [0.0; 3], |_| false)?;
        let place = |f: fn([f64; 3]) -> [f64; 3]| model.positions().iter().map(|&x| f(x)).collect();
        // Turned by 50 degrees about (1, 2, 2) / 3.
        let moved = laboratory.forces(&model, place(|x| turned(x, [0.3, -0.2, 0.5])))?;
        let stretched = place(|[x, y, z]| [1.01 * x, y, z]);
        let stretched = laboratory.forces(&model, stretched)?;
        let ratio = largest(&moved) / largest(&stretched);
        let bound = if laboratory.is_double() { 1e-10 } else { 0.02 };
        outcome.between("force", (kind, cells), "", ratio, [0.0, bound]);
    }
    Ok(outcome)
}

/// Turned by 50 degrees about (1, 2, 2) / 3, then shifted.
fn turned(x: [f64; 3], shift: [f64; 3]) -> [f64; 3] {
    let axis = [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0];
    let (s, c) = 50_f64.to_radians().sin_cos();
    let along = (0..3).map(|k| axis[k] * x[k]).sum::<f64>();
    let cross = [
        axis[1] * x[2] - axis[2] * x[1],
        axis[2] * x[0] - axis[0] * x[2],
        axis[0] * x[1] - axis[1] * x[0],
    ];
    std::array::from_fn(|k| c * x[k] + s * cross[k] + (1.0 - c) * along * axis[k] + shift[k])
}

fn patch_test(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let fabric = poplin();
    // Stretched along and across, and sheared.
    let gradient = [[1.03, 0.02], [0.01, 1.01]];
    let at = |[x, y, _]: [f64; 3]| {
        let [a, b] = gradient;
        [a[0] * x + a[1] * y, b[0] * x + b[1] * y, 0.0]
    };
    let column = |k: usize| [gradient[0][k], gradient[1][k]];
    let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let [u, v] = [column(0), column(1)];
    let strain = [0.5 * (product(u, u) - 1.0), 0.5 * (product(v, v) - 1.0), 0.5 * product(u, v)];
    let [sxx, _, sxy] = membrane::stress(&fabric, strain, 0.3);
    // The traction on the end, for its length at rest: F S e_x.
    let expected: [f64; 2] = std::array::from_fn(|k| u[k] * sxx + v[k] * sxy);
    for (kind, cells) in meshes(laboratory, [10, 20]) {
        let of = (kind, cells);
        let model = laboratory.model(strip(kind, cells).mesh(), fabric, [0.0; 3], |_| false)?;
        let forces =
            laboratory.forces(&model, model.positions().iter().map(|&x| at(x)).collect())?;
        let is_inside = |&[x, y, _]: &[f64; 3]| {
            x > 1e-9 && x < SIZE[0] - 1e-9 && y > 1e-9 && y < SIZE[1] - 1e-9
        };
        let within: Vec<_> = model
            .positions()
            .iter()
            .zip(&forces)
            .filter(|(x, _)| is_inside(x))
            .map(|(_, f)| *f)
            .collect();
        let [bound, tolerance] = if laboratory.is_double() { [1e-10, 1e-9] } else { [2e-3, 1e-3] };
        let ratio = largest(&within) / largest(&forces);
        outcome.between("force within", of, "", ratio, [0.0, bound]);
        let pull = laboratory.mean_stress(
            &model,
            model.positions().iter().map(|&x| at(x)).collect(),
            0,
        )?;
        outcome.value("stress along", of, "N/m", pull[0], [expected[0], tolerance]);
        outcome.value("stress across", of, "N/m", pull[1], [expected[1], tolerance]);
    }
    Ok(outcome)
}
