//! A piece that is sheared.

use cloth_core::Result;

use super::{Experiment, changed, meshes, poplin};
use crate::{
    Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot,
    meshes::Strip,
    statics::{Settling, Statics},
};

pub(super) const PICTURE_FRAME: Experiment = Experiment {
    name: "shear",
    title: "A piece is sheared in a picture frame, its threads as long as before: force along a side per width",
    source: "G sin(gamma) for the angle gamma by which the threads turn",
    control: changed(|fabric| fabric.shear *= 1.1),
    run,
};

const SIZE: f64 = 0.08;

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let fabric = poplin();
    let mut outcome = Outcome::default();
    let theory = |degrees: f64| fabric.shear * degrees.to_radians().sin();
    let mut plot = Plot {
        title: "Shear in a picture frame".into(),
        axes: ["angle [degrees]".into(), "force per width [N/m]".into()],
        curves: vec![Curve {
            name: "G sin(gamma)".into(),
            style: CurveStyle::Line,
            points: (0..=30).map(f64::from).map(|angle| [angle, theory(angle)]).collect(),
        }],
        ..Plot::default()
    };
    for (kind, cells) in meshes(laboratory, [8, 16]) {
        let strip = Strip { length: SIZE, width: SIZE, cells: [cells; 2], kind, angle: 0.0 };
        let is_border = |x: [f64; 3]| (0..2).any(|k| x[k] < 1e-9 || x[k] > SIZE - 1e-9);
        let model = laboratory.model(strip.mesh(), fabric, [0.0; 3], is_border)?;
        let rest = model.positions();
        let mut statics = Statics::new(laboratory, &model)?;
        let mut curve = Curve { name: format!("{} {cells}", kind.name()), ..Curve::default() };
        for degrees in [1.0_f64, 8.0, 24.0] {
            let half = 0.5 * degrees.to_radians();
            let (s, c) = half.sin_cos();
            // What is within starts where it would stay, but for a tenth of a cell.
            let mut random = fastrand::Rng::with_seed(7);
            let off: Vec<f64> = (0..2 * rest.len())
                .map(|_| 0.2 * SIZE / f64::from(cells) * (random.f64() - 0.5))
                .collect();
            statics.place(|i, _| {
                let [u, v, _] = rest[i];
                let [du, dv] =
                    if is_border(rest[i]) { [0.0; 2] } else { [off[2 * i], off[2 * i + 1]] };
                [c * u + s * v + du, s * u + c * v + dv, 0.0]
            });
            let is_rest = statics.settle(&Settling::of(laboratory))?;
            // On the cut along the warp.
            let positions = statics.positions().to_vec();
            let pull = laboratory.mean_stress(&model, positions, 1)?;
            let measured = if is_rest { pull[0] * c + pull[1] * s } else { f64::NAN };
            let case = format!("{degrees} degrees");
            outcome.value(case, (kind, cells), "N/m", measured, [theory(degrees), 0.02]);
            curve.points.push([degrees, measured]);
        }
        if kind == MeshKind::Irregular {
            plot.curves.push(curve);
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}
