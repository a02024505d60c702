//! Strips that are stretched.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use cloth_core::Result;

use super::{Experiment, TIGHT, meshes, poplin};
use crate::{
    Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot,
    meshes::Strip,
    statics::{Settling, Statics},
    theory::membrane::{green, stress, uniaxial},
};

pub(super) const STRIP_BIAXIAL: Experiment = Experiment {
    name: "strip-biaxial",
    title: "A piece is stretched while its width is kept, as in Kawabata's tensile test: force per width",
    source: "the curves of the fabric, and its law at 45 degrees",
    control: TIGHT,
    run: strip_biaxial,
};

pub(super) const UNIAXIAL: Experiment = Experiment {
    name: "uniaxial",
    title: "A long strip is stretched between two clamps, its sides free: force per width, and how much narrower its middle gets, for the strain of \
            the middle third (an optical extensometer)",
    source: "the law of the fabric without stress across; the ratio of the strains is that of Poisson",
    control: TIGHT,
    run: free_sides,
};

const DIRECTIONS: [(&str, f64); 3] = [("warp", 0.0), ("weft", FRAC_PI_2), ("bias", FRAC_PI_4)];

fn strip_biaxial(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let fabric = poplin();
    let mut outcome = Outcome::default();
    let [length, width] = [0.1, 0.05];
    let mut plot = Plot {
        title: "Strip biaxial stretch".into(),
        axes: ["elongation [%]".into(), "force per width [N/m]".into()],
        ..Plot::default()
    };
    let force = |elongation: f64, angle: f64| {
        (1.0 + elongation) * stress(&fabric, [green(elongation), 0.0, 0.0], angle)[0]
    };
    for (name, angle) in DIRECTIONS {
        let points = (0..=40).map(|i| 0.0025 * f64::from(i)).map(|e| [100.0 * e, force(e, angle)]);
        plot.curves.push(Curve {
            name: format!("{name}, given"),
            style: CurveStyle::Line,
            points: points.collect(),
        });
    }
    let elongations: &[f64] =
        if laboratory.is_full() { &[0.01, 0.03, 0.06, 0.09] } else { &[0.03, 0.08] };
    for (name, angle) in DIRECTIONS {
        for (kind, cells) in meshes(laboratory, [8, 16]) {
            let strip = Strip { length, width, cells: [cells, cells / 2], kind, angle };
            let is_border =
                |[x, y, _]: [f64; 3]| x < 1e-9 || x > length - 1e-9 || y < 1e-9 || y > width - 1e-9;
            let model = laboratory.model(strip.mesh(), fabric, [0.0; 3], is_border)?;
            let mut curve =
                Curve { name: format!("{name}, {} {cells}", kind.name()), ..Curve::default() };
            let mut statics = Statics::new(laboratory, &model)?;
            for &elongation in elongations {
                // The border goes to where it is held; what is within starts from where it was.
                let rest = model.positions();
                statics.place(|i, x| {
                    if is_border(rest[i]) {
                        [(1.0 + elongation) * rest[i][0], rest[i][1], 0.0]
                    } else {
                        x
                    }
                });
                let is_rest = statics.settle(&Settling::of(laboratory))?;
                let positions = statics.positions().to_vec();
                let [pull, _] = laboratory.mean_stress(&model, positions, 0)?;
                let measured = if is_rest { pull } else { f64::NAN };
                let expected = force(elongation, angle);
                let case = format!("{name} at {:.0} %", 100.0 * elongation);
                outcome.value(case, (kind, cells), "N/m", measured, [expected, 0.02]);
                curve.points.push([100.0 * elongation, measured]);
            }
            if (kind, cells) == (MeshKind::Irregular, 8) {
                plot.curves.push(curve);
            }
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}

/// Length over width of the strip: what the clamps do to the shape is gone in its middle third.
const SLENDERNESS: f64 = 24.0;

fn free_sides(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let fabric = poplin();
    let mut outcome = Outcome::default();
    let width = 0.025;
    let length = SLENDERNESS * width;
    let mut forces_plot = Plot {
        title: "Uniaxial stretch".into(),
        axes: ["Green strain along [%]".into(), "force per width [N/m]".into()],
        ..Plot::default()
    };
    let mut widths_plot = Plot {
        title: "Poisson coupling".into(),
        axes: ["Green strain along [%]".into(), "Green strain across [%]".into()],
        ..Plot::default()
    };
    let theory = |e: f64, angle: f64| {
        let (strain, stress) = uniaxial(&fabric, e, angle);
        [(1.0 + 2.0 * e).sqrt() * stress[0], strain[1]]
    };
    for (name, angle) in DIRECTIONS {
        for (k, plot) in [&mut forces_plot, &mut widths_plot].into_iter().enumerate() {
            let scale = [1.0, 100.0][k];
            let points = (1..=40).map(|i| 0.0025 * f64::from(i));
            plot.curves.push(Curve {
                name: format!("{name}, given"),
                style: CurveStyle::Line,
                points: points.map(|e| [100.0 * e, scale * theory(e, angle)[k]]).collect(),
            });
        }
    }
    let elongations: &[f64] = if laboratory.is_full() { &[0.02, 0.06] } else { &[0.04] };
    for (name, angle) in DIRECTIONS {
        for (kind, cells) in meshes(laboratory, [48, 96]) {
            let strip = Strip { length, width, cells: [cells, cells / 12], kind, angle };
            let is_clamped = |x: [f64; 3]| x[0] < 1e-9 || x[0] > length - 1e-9;
            let model = laboratory.model(strip.mesh(), fabric, [0.0; 3], is_clamped)?;
            let rest = model.positions();
            let mut statics = Statics::new(laboratory, &model)?;
            let mut curves = [0, 1].map(|_| Curve {
                name: format!("{name}, {} {cells}", kind.name()),
                ..Curve::default()
            });
            let mut before = 0.0;
            for &elongation in elongations {
                // All of it is stretched by as much more; sides are free to follow.
                let more = (1.0 + elongation) / (1.0 + before);
                before = elongation;
                statics.place(|i, x| {
                    if is_clamped(rest[i]) {
                        [(1.0 + elongation) * rest[i][0], rest[i][1], 0.0]
                    } else {
                        [more * x[0], x[1], x[2]]
                    }
                });
                let is_rest = statics.settle(&Settling::of(laboratory))?;
                let forces = laboratory.forces(&model, statics.positions().to_vec())?;
                let mut pull = [0.0; 2];
                for (_, f) in rest.iter().zip(&forces).filter(|(x, _)| x[0] > length - 1e-9) {
                    (0..2).for_each(|k| pull[k] += f[k] / width);
                }
                let [along, across] = gauge(rest, statics.positions(), length);
                let along = if is_rest { along } else { f64::NAN };
                let pull = pull[0].hypot(pull[1]);
                let [force, narrowing] = theory(along, angle);
                let of = (kind, cells);
                let at = format!("at {:.0} %", 100.0 * elongation);
                outcome.value(format!("{name} {at}: force"), of, "N/m", pull, [force, 0.02]);
                outcome.value(
                    format!("{name} {at}: Poisson ratio"),
                    of,
                    "",
                    -across / along,
                    [-narrowing / along, 0.02],
                );
                curves[0].points.push([100.0 * along, pull]);
                curves[1].points.push([100.0 * along, 100.0 * across]);
            }
            if (kind, cells) == (MeshKind::Irregular, 48) {
                let [first, second] = curves;
                forces_plot.curves.push(first);
                widths_plot.curves.push(second);
            }
        }
    }
    outcome.plots.extend([forces_plot, widths_plot]);
    Ok(outcome)
}

/// Where a vertex was at rest, and where it is now \[m\].
type Places<'a> = (&'a [f64; 3], &'a [f64; 3]);

/// Green strain along and across of the linear map that is closest to how the middle third of a strip was deformed.
fn gauge(rest: &[[f64; 3]], now: &[[f64; 3]], length: f64) -> [f64; 2] {
    let middle: Vec<Places<'_>> = rest
        .iter()
        .zip(now)
        .filter(|(x, _)| x[0] > length / 3.0 && x[0] < 2.0 * length / 3.0)
        .collect();
    let count = middle.len() as f64;
    let mean = |of: &dyn Fn(&Places<'_>) -> f64| middle.iter().map(of).sum::<f64>() / count;
    let rest_mean = [0, 1].map(|k| mean(&|(x, _)| x[k]));
    let now_mean = [0, 1].map(|k| mean(&|(_, x)| x[k]));
    let moment = |i: usize, j: usize| mean(&|(x, _)| (x[i] - rest_mean[i]) * (x[j] - rest_mean[j]));
    let mixed = |i: usize, j: usize| mean(&|(x, y)| (y[i] - now_mean[i]) * (x[j] - rest_mean[j]));
    let [a, b, c] = [moment(0, 0), moment(0, 1), moment(1, 1)];
    let determinant = a * c - b * b;
    let row = |i: usize| {
        let [p, q] = [mixed(i, 0), mixed(i, 1)];
        [(p * c - q * b) / determinant, (q * a - p * b) / determinant]
    };
    let [x, y] = [row(0), row(1)];
    [0, 1].map(|k| 0.5 * (x[k] * x[k] + y[k] * y[k] - 1.0))
}
