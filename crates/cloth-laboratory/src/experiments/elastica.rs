//! A strip that is clamped at one end and bends under its own weight.

use cloth_core::{Result, fabric::Fabric};

use super::{Experiment, GRAVITY, STIFF, meshes, stiff_fabric};
use crate::{
    Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot, meshes::Strip, theory::elastica,
};

pub(super) const HEAVY_ELASTICA: Experiment = Experiment {
    name: "elastica",
    title: "A strip of rigidity B and weight rho g per area is clamped level at one end: drop over reach of its free end for \
            Gamma = rho g L^3 / B",
    source: "the equation of the heavy elastica (Bickley 1934), integrated",
    control: STIFF,
    run,
};

/// Gamma, and the drop of the free end over its reach.
const HEAVY: [[f64; 2]; 6] = [
    [0.1, 0.012_500],
    [1.0, 0.124_562],
    [2.0, 0.246_673],
    [5.0, 0.585_721],
    [10.0, 1.066_802],
    [100.0, 5.888_105],
];

/// Length and width of the strip \[m\].
const SIZE: [f64; 2] = [0.2, 0.04];

/// Mass per area \[kg/m^2\].
const DENSITY: f64 = 0.2;

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let theory = (-10..=20).map(|i| 10_f64.powf(0.1 * f64::from(i)));
    let mut plot = Plot {
        title: "Heavy elastica".into(),
        axes: ["Gamma".into(), "drop over reach".into()],
        logarithmic: [true, true],
        curves: vec![Curve {
            name: "theory".into(),
            style: CurveStyle::Line,
            points: theory.map(|gamma| [gamma, elastica::free_end(gamma).ratio()]).collect(),
        }],
    };
    for (kind, cells) in meshes(laboratory, [20, 40]) {
        let mut curve = Curve { name: format!("{} {cells}", kind.name()), ..Curve::default() };
        let all = if laboratory.is_full() { &HEAVY[..] } else { &HEAVY[1..6] };
        for &[gamma, ratio] in all {
            let rigidity = DENSITY * GRAVITY * SIZE[0].powi(3) / gamma;
            let cantilever = Cantilever {
                size: SIZE,
                cells: [cells, (cells / 5).max(2)],
                kind,
                angle: 0.0,
                fabric: stiff_fabric(DENSITY, rigidity),
            };
            let measured = cantilever.free_end(laboratory)?.ratio();
            outcome.value(format!("Gamma {gamma}"), (kind, cells), "", measured, [ratio, 0.02]);
            curve.points.push([gamma, measured]);
        }
        plot.curves.push(curve);
    }
    outcome.plots.push(plot);
    Ok(outcome)
}

/// A strip that is clamped level at one end.
pub(super) struct Cantilever {
    /// Free length and width \[m\].
    pub(super) size: [f64; 2],
    /// Cells along them.
    pub(super) cells: [u32; 2],
    pub(super) kind: MeshKind,
    /// From the warp to its length \[rad\].
    pub(super) angle: f64,
    pub(super) fabric: Fabric,
}

impl Cantilever {
    /// Where its free end comes to rest, as seen from the clamp \[m\].
    pub(super) fn free_end(&self, laboratory: &Laboratory<'_>) -> Result<elastica::FreeEnd> {
        let [length, width] = self.size;
        let strip = Strip::clamped([length, width], self.cells, (self.kind, self.angle));
        let cell = strip.cell();
        let is_held = |x: [f64; 3]| x[0] < 1.01 * cell;
        let model = laboratory.model(strip.mesh(), self.fabric, [0.0, 0.0, -GRAVITY], is_held)?;
        let positions = laboratory.rest(&model)?;
        let end = strip.length - 1e-9;
        let (mut drop, mut reach, mut count) = (0.0, 0.0, 0.0);
        for (_, x) in model.positions().iter().zip(&positions).filter(|(x, _)| x[0] > end) {
            drop -= x[2];
            reach += x[0] - 0.5 * cell;
            count += 1.0;
        }
        Ok(elastica::FreeEnd { drop: drop / count, reach: reach / count })
    }
}
