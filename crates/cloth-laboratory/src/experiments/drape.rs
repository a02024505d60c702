//! Cusick's drape test: a round specimen hangs over a round support.

use cloth_core::{
    Result,
    fabric::{BendingRigidity, Fabric, InternalFriction, TensileCurve},
};

use super::{Experiment, GRAVITY, changed};
use crate::{
    Curve, CurveStyle, Laboratory, MeshKind, Outcome, Plot,
    meshes::Ring,
    statics::{Settling, Statics},
};

pub(super) const CUSICK: Experiment = Experiment {
    name: "cusick",
    title: "Cusick's drape test: a specimen of 300 mm across on a support of 180 mm: drape coefficient, how much of the ring that is not supported lies in the \
            shadow",
    source: "what is measured of such fabrics: silk 20 to 40, cotton 60 to 76, denim 70 to 90 %; and the finer mesh within 3 % of the coarser one",
    control: changed(|fabric| {
        fabric.bending.warp *= 8.0;
        fabric.bending.weft *= 8.0;
        fabric.bending.bias = fabric.bending.bias.map(|bias| 8.0 * bias);
    }),
    run,
};

/// Radii of support and specimen \[m\].
const RADII: [f64; 2] = [0.09, 0.15];

/// Name, weight \[kg/m^2\], rigidities along warp, weft and bias \[N m\], shear \[N/m\], range of the drape coefficient \[%\], cells around of
/// a coarse and a fine mesh: at most two thirds of (B / rho g)^1/3, the length on which a fabric folds. (Denim on the regular mesh finds no rest
/// with 72, 80 and 100 cells, and has 78 % with 60 and 90.)
type Draped = (&'static str, f64, [f64; 3], f64, [f64; 2], [u32; 2]);

const FABRICS: [Draped; 3] = [
    ("silk", 0.060, [1.3e-6, 0.9e-6, 0.8e-6], 15.0, [20.0, 40.0], [150, 180]),
    ("cotton", 0.130, [1.1e-5, 0.8e-5, 0.7e-5], 60.0, [60.0, 76.0], [72, 120]),
    ("denim", 0.370, [6.5e-5, 4.5e-5, 4.2e-5], 150.0, [70.0, 90.0], [90, 120]),
];

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut plot = Plot {
        title: "Edges of draped specimens, seen from above".into(),
        axes: ["x [mm]".into(), "y [mm]".into()],
        ..Plot::default()
    };
    // What takes minutes is left out where little is to be done.
    let fabrics = if laboratory.is_full() { &FABRICS[..] } else { &FABRICS[1..] };
    for &(name, area_density, [warp, weft, bias], shear, range, [coarse, fine]) in fabrics {
        let cases = if laboratory.is_full() {
            vec![
                (MeshKind::Regular, coarse),
                (MeshKind::Alternating, coarse),
                (MeshKind::Irregular, coarse),
                (MeshKind::Irregular, fine),
            ]
        } else {
            vec![(MeshKind::Irregular, 60)]
        };
        for &(kind, around) in &cases {
            let fabric = Fabric {
                area_density,
                thickness: 0.3e-3,
                warp: TensileCurve::linear(1e3),
                weft: TensileCurve::linear(6e2),
                coupling: 0.0,
                shear,
                bending: BendingRigidity { warp, weft, bias: Some(bias) },
                friction: InternalFriction::default(),
                damping: [0.0; 2],
                stretch_limit: f64::INFINITY,
            };
            let (coefficient, edge) = drape(laboratory, fabric, (kind, around))?;
            outcome.between(name, (kind, around), "%", coefficient, range);
            if cases.last() == Some(&(kind, around)) {
                let curve = Curve { name: name.into(), style: CurveStyle::Line, points: edge };
                plot.curves.push(curve);
            }
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}

/// The drape coefficient \[%\], and the edge seen from above \[mm\].
fn drape(
    laboratory: &Laboratory<'_>,
    fabric: Fabric,
    (kind, around): (MeshKind, u32),
) -> Result<(f64, Vec<[f64; 2]>)> {
    // The first ring of cells is held; its middle is where the support ends.
    let out = around / 10;
    let cell = (RADII[1] - RADII[0]) / (f64::from(out) - 0.5);
    let ring = Ring { radii: [RADII[0] - 0.5 * cell, RADII[1]], cells: [around, out], kind };
    let support = RADII[0] + 0.51 * cell;
    let model = laboratory
        .model(ring.mesh(), fabric, [0.0, 0.0, -GRAVITY], |x| x[0].hypot(x[1]) < support)?;
    let mut statics = Statics::new(laboratory, &model)?;
    // No specimen is perfectly flat: that decides where folds begin.
    let mut random = fastrand::Rng::with_seed(3);
    let dents: Vec<f64> =
        (0..model.particle_count()).map(|_| 2e-4 * (random.f64() - 0.5)).collect();
    let rest = model.positions();
    statics.place(
        |i, x| if rest[i][0].hypot(rest[i][1]) < support { x } else { [x[0], x[1], dents[i]] },
    );
    let settling = Settling { motion: 1e-5, ..Settling::of(laboratory) };
    if !statics.settle(&settling)? {
        return Ok((f64::NAN, Vec::new()));
    }
    let positions = statics.positions();
    let first = (out * around) as usize;
    let mut edge: Vec<[f64; 2]> =
        positions[first..].iter().map(|x| [1e3 * x[0], 1e3 * x[1]]).collect();
    edge.push(edge[0]);
    let [inner, outer] = RADII.map(|radius| std::f64::consts::PI * radius * radius);
    Ok((100.0 * (shadow(positions, &ring.mesh().triangles) - inner) / (outer - inner), edge))
}

/// Area of the shadow of a specimen and its support \[m^2\].
fn shadow(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    const SIDE: usize = 800;
    let pixel = 2.2 * RADII[1] / SIDE as f64;
    let place = |index: usize| (index as f64 + 0.5 - 0.5 * SIDE as f64) * pixel;
    let index = |x: f64| (x / pixel + 0.5 * SIDE as f64 - 0.5).clamp(0.0, SIDE as f64 - 1.0);
    let mut dark = vec![false; SIDE * SIDE];
    for (i, dark) in dark.iter_mut().enumerate() {
        *dark = place(i / SIDE).hypot(place(i % SIDE)) < RADII[0];
    }
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
        let range = |k: usize| {
            let [low, high] = [a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k])];
            index(low).ceil() as usize..=index(high).floor() as usize
        };
        let turn = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        for row in range(1) {
            for column in range(0) {
                let [x, y] = [place(column), place(row)];
                let turns = [turn(a, b, x, y), turn(b, c, x, y), turn(c, a, x, y)];
                if turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0) {
                    dark[row * SIDE + column] = true;
                }
            }
        }
    }
    dark.iter().filter(|&&dark| dark).count() as f64 * pixel * pixel
}
