//! The cantilever test of ASTM D1388, option A: a strip is pushed over an edge until its end lies 41.5 degrees below it.

use std::f64::consts::FRAC_PI_2;

use cloth_core::{
    Error, Result,
    fabric::{Fabric, overhang_rigidity},
};
use cloth_scene::MeasuredFabric;

use super::{Experiment, GRAVITY, STIFF, elastica::Cantilever, meshes};
use crate::{Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot};

pub(super) const ASTM_D1388: Experiment = Experiment {
    name: "d1388",
    title: "The cantilever test of ASTM D1388 on fabrics of the library: B = rho g (overhang / 2)^3 from the overhang at which the end of a strip lies 41.5 \
            degrees below the edge",
    source: "the rigidity that the source of the fabric gives",
    control: STIFF,
    run,
};

/// Slope of the line from the edge to the end of the strip.
const ANGLE: f64 = 41.5;

const FABRICS: [&str; 10] = [
    "ivory-rib-knit",
    "pink-ribbon-brown",
    "white-dots-on-black",
    "camel-ponte-roma",
    "gray-interlock",
    "11oz-black-denim",
    "tango-red-jet-set",
    "royal-target",
    "drape-003",
    "drape-018",
];

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut plot = Plot {
        title: "ASTM D1388".into(),
        axes: ["rigidity given [1e-6 N m]".into(), "rigidity measured [1e-6 N m]".into()],
        logarithmic: [true, true],
        curves: vec![Curve { name: "equal".into(), style: CurveStyle::Line, points: Vec::new() }],
    };
    let fabrics = if laboratory.is_full() { &FABRICS[..] } else { &FABRICS[5..6] };
    for &name in fabrics {
        let invalid = |error: cloth_core::fabric::FabricError| Error::Invalid(error.into());
        let measured = MeasuredFabric::find(name).map_err(|error| Error::Unsupported {
            backend: "laboratory",
            feature: error.to_string(),
        })?;
        let (fabric, _) = measured.fit().map_err(invalid)?;
        for (thread, angle, rigidity) in
            [("warp", 0.0, fabric.bending.warp), ("weft", FRAC_PI_2, fabric.bending.weft)]
        {
            for (kind, cells) in meshes(laboratory, [20, 40]) {
                let found = rigidity_measured(laboratory, &fabric, angle, (kind, cells), rigidity)?;
                let [found, expected] = [1e6 * found, 1e6 * rigidity];
                let case = format!("{name} {thread}");
                outcome.value(case, (kind, cells), "1e-6 N m", found, [expected, 0.03]);
                let Some(line) = plot.curves.first_mut() else { continue };
                line.points.push([expected, expected]);
                let series = format!("{} {cells}", kind.name());
                match plot.curves.iter_mut().find(|curve| curve.name == series) {
                    Some(curve) => curve.points.push([expected, found]),
                    None => plot.curves.push(Curve {
                        name: series,
                        points: vec![[expected, found]],
                        ..Curve::default()
                    }),
                }
            }
        }
    }
    plot.curves[0].points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    outcome.plots.push(plot);
    Ok(outcome)
}

/// By two overhangs, the second one where the first one says that the angle is right: the angle between them is nearly that of a line.
fn rigidity_measured(
    laboratory: &Laboratory<'_>,
    fabric: &Fabric,
    angle: f64,
    (kind, cells): (MeshKind, u32),
    guess: f64,
) -> Result<f64> {
    let slope = |overhang: f64| {
        let size = [overhang, 0.3 * overhang];
        let cantilever =
            Cantilever { size, cells: [cells, cells / 4], kind, angle, fabric: *fabric };
        cantilever.free_end(laboratory).map(|end| end.ratio().atan().to_degrees())
    };
    let first = 2.0 * (guess / (fabric.area_density * GRAVITY)).cbrt();
    let at_first = slope(first)?;
    if !at_first.is_finite() {
        return Ok(f64::NAN);
    }
    // Near it the angle grows by some 62 degrees for a doubled logarithm of the overhang.
    let second = first * ((ANGLE - at_first) / 62.0).exp();
    let at_second = slope(second)?;
    let change = at_second - at_first;
    let share = if change.abs() > 1e-3 { (ANGLE - at_second) / change } else { 0.0 };
    let overhang = second * (second / first).powf(share);
    Ok(overhang_rigidity(fabric.area_density, overhang))
}
