//! Strips that are cut at an angle to the threads and bend under their own weight.

use cloth_core::{Result, fabric::BendingRigidity};

use super::{Experiment, GRAVITY, STIFF, elastica::Cantilever, meshes, stiff_fabric};
use crate::{Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot, theory::elastica};

pub(super) const BIAS_STRIPS: Experiment = Experiment {
    name: "bias-strips",
    title: "Strips cut at 0, 45 and 90 degrees to the warp bend under their own weight: the rigidity that the heavy elastica has with the same drop over \
            reach",
    source: "the rigidities given, B1, B45 and B2, which are those of narrow strips",
    control: STIFF,
    run,
};

const DENSITY: f64 = 0.2;
/// Narrow: a clamp keeps a strip from twisting along about its width.
const SIZE: [f64; 2] = [0.15, 0.003];

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let warp = DENSITY * GRAVITY * SIZE[0].powi(3) / 4.0;
    let bending = BendingRigidity { warp, weft: 0.6 * warp, bias: Some(0.5 * warp) };
    let mut plot = Plot {
        title: "Rigidity of strips".into(),
        axes: ["angle from the warp [degrees]".into(), "rigidity [1e-6 N m]".into()],
        curves: vec![Curve {
            name: "given".into(),
            style: CurveStyle::Line,
            points: vec![
                [0.0, 1e6 * bending.warp],
                [45.0, 0.5e6 * warp],
                [90.0, 1e6 * bending.weft],
            ],
        }],
        ..Plot::default()
    };
    for (kind, cells) in meshes(laboratory, [24, 48]) {
        let mut curve = Curve { name: format!("{} {cells}", kind.name()), ..Curve::default() };
        for (degrees, expected) in [(0.0_f64, warp), (45.0, 0.5 * warp), (90.0, 0.6 * warp)] {
            let fabric = cloth_core::fabric::Fabric { bending, ..stiff_fabric(DENSITY, warp) };
            let angle = degrees.to_radians();
            let cantilever =
                Cantilever { size: SIZE, cells: [cells, (cells / 12).max(2)], kind, angle, fabric };
            let ratio = cantilever.free_end(laboratory)?.ratio();
            let gamma = elastica::gamma_of_ratio(ratio);
            let measured = DENSITY * GRAVITY * SIZE[0].powi(3) / gamma;
            let case = format!("{degrees} degrees");
            outcome.value(case, (kind, cells), "1e-6 N m", 1e6 * measured, [1e6 * expected, 0.02]);
            curve.points.push([degrees, 1e6 * measured]);
        }
        if kind != MeshKind::Regular {
            plot.curves.push(curve);
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}
