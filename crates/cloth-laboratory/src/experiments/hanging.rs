//! A strip that hangs from one end and is stretched by its own weight.

use cloth_core::{Result, fabric::TensileCurve};

use super::{Experiment, GRAVITY, TIGHT, meshes, poplin};
use crate::{
    Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot,
    meshes::Strip,
    theory::membrane::{curve_stress, green},
};

pub(super) const HANGING: Experiment = Experiment {
    name: "hanging",
    title: "A strip of a knit hangs from one end: elongation under its own weight",
    source: "the tensile curve under the weight of what hangs below, integrated",
    control: TIGHT,
    run,
};

const SIZE: [f64; 2] = [1.0, 0.1];

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut fabric = poplin();
    fabric.area_density = 0.3;
    fabric.warp = TensileCurve { linear: 20.0, cubic: 2e4, end: 0.2 };
    fabric.coupling = 0.0;
    let weight = fabric.area_density * GRAVITY;
    let elongation = |load: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let e = 0.5 * (low + high);
            if (1.0 + e) * curve_stress(&fabric.warp, green(e)) > load { high = e } else { low = e }
        }
        low
    };
    const PARTS: u32 = 1000;
    let part = SIZE[0] / f64::from(PARTS);
    let mut lengths = vec![[0.0, 0.0]];
    for i in 0..PARTS {
        // From the upper end down.
        let load = weight * (SIZE[0] - (f64::from(i) + 0.5) * part);
        let [x, sum] = lengths[i as usize];
        lengths.push([x + part, sum + part * elongation(load)]);
    }
    let expected = lengths[PARTS as usize][1] / SIZE[0];
    let mut outcome = Outcome::default();
    let mut plot = Plot {
        title: "Elongation of a hanging strip".into(),
        axes: ["distance from the upper end [m]".into(), "displacement [mm]".into()],
        curves: vec![Curve {
            name: "theory".into(),
            style: CurveStyle::Line,
            points: lengths.iter().step_by(20).map(|&[x, d]| [x, 1e3 * d]).collect(),
        }],
        ..Plot::default()
    };
    for (kind, cells) in meshes(laboratory, [10, 20]) {
        let [length, width] = SIZE;
        let strip = Strip { length, width, cells: [cells, cells / 5], kind, angle: 0.0 };
        let model = laboratory.model(strip.mesh(), fabric, [GRAVITY, 0.0, 0.0], |x| x[0] < 1e-9)?;
        let positions = laboratory.rest(&model)?;
        let moved = model.positions().iter().zip(&positions);
        let end: Vec<f64> =
            moved.clone().filter(|(x, _)| x[0] > length - 1e-9).map(|(a, b)| b[0] - a[0]).collect();
        let measured = end.iter().sum::<f64>() / end.len() as f64 / length;
        outcome.value("elongation", (kind, cells), "", measured, [expected, 0.02]);
        if (kind, cells) == (MeshKind::Irregular, 10) {
            let points =
                moved.filter(|(x, _)| x[1] < 1e-9).map(|(a, b)| [a[0], 1e3 * (b[0] - a[0])]);
            let name = format!("{} {cells}", kind.name());
            plot.curves.push(Curve { name, points: points.collect(), ..Curve::default() });
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}
