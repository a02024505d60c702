//! A strip over a bar: friction along a curve.

use std::{f64::consts::PI, sync::Arc};

use cloth_core::{
    Aerodynamics, Cloth, Collider, ColliderShape, ContactResponse, Error, FabricMaterial, Field,
    Frame, Geometry, ImplicitSettings, Integrator, Model, ModelBuilder, Pose, RestSource, Result,
    SelfContact, SolverConfig, State,
    fabric::{Fabric, USUAL_DAMPING},
};

use super::{Experiment, GRAVITY, stiff_fabric};
use crate::{Curve, CurveStyle, Flaw, Laboratory, MeshKind, Outcome, Plot, meshes::Strip};

pub(super) const CAPSTAN: Experiment = Experiment {
    name: "capstan",
    title: "A strip hangs over a round bar, one side longer than the other, until it slips, in steps of 1/60 s of the implicit integrator",
    source: "Euler 1769: e^(mu pi) times the load on the other side, with the weight of the strip on the bar counted",
    control: Flaw { fabric: None, pattern_growth: 0.0, is_damped: false, slipperiness: 0.1 },
    run,
};

/// Friction with the bar.
const FRICTION: f64 = 0.3;
/// Radius of the bar, and where cloth lies on it \[m\].
const BAR: f64 = 0.04;
const RADIUS: f64 = BAR + 0.5 * DISTANCE;
/// Distance at which contact begins \[m\].
const DISTANCE: f64 = 2e-3;
/// Length of the side that is lifted \[m\].
const SHORT: f64 = 0.2;
/// Cells along it.
const CELLS: [u32; 2] = [40, 80];
/// Length of a step \[s\].
const STEP: f64 = 1.0 / 60.0;
/// Steps in which the strip comes to hang, and in which it is watched.
const STEPS: [u32; 2] = [24, 36];
/// Resistance of the air \[1/s\]: what begins to hang would swing else, and be heavier than it is.
const DRAG: f64 = 30.0;
/// What has fallen farther slips \[m\].
const SLIP: f64 = 2e-4;
/// Shares of the length of theory between which it is looked for.
const SHARES: [f64; 2] = [0.94, 1.06];

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let expected = hanging_at_slip(FRICTION);
    let mut marks = Vec::new();
    for (kind, cells) in super::meshes(laboratory, CELLS) {
        let edge = SHORT / f64::from(cells);
        let [mut holds, mut slips] = SHARES.map(|share| (share * expected / edge).round() as u32);
        while slips - holds > 1 {
            let middle = u32::midpoint(holds, slips);
            let fallen = fallen(laboratory, (kind, cells), middle)?;
            *(if fallen > SLIP { &mut slips } else { &mut holds }) = middle;
        }
        let longest = edge * (f64::from(slips) - 0.5);
        outcome.value("length at which it slips", (kind, cells), "m", longest, [expected, 0.02]);
        if kind == MeshKind::Regular {
            marks.push([FRICTION, longest]);
        }
    }
    let theory = (0..=20).map(|k| 0.025 * f64::from(k)).map(|mu| [mu, hanging_at_slip(mu)]);
    outcome.plots.push(Plot {
        title: format!("How long one side hangs when it slips, the other {SHORT} m"),
        axes: ["friction".into(), "length [m]".into()],
        curves: vec![
            Curve { name: "theory".into(), style: CurveStyle::Line, points: theory.collect() },
            Curve { name: "regular".into(), points: marks, ..Curve::default() },
        ],
        ..Plot::default()
    });
    Ok(outcome)
}

/// How long the side that falls hangs \[m\] when the strip is about to slip. With its weight per length 1, the tension T along an angle a of the bar
/// has dT / da = mu (T + R sin a) + R cos a.
fn hanging_at_slip(friction: f64) -> f64 {
    let steps = 10_000;
    let step = PI / f64::from(steps);
    (0..steps).fold(SHORT, |tension, k| {
        let (sin, cos) = (step * (f64::from(k) + 0.5)).sin_cos();
        tension + step * (friction * (tension + RADIUS * sin) + RADIUS * cos)
    })
}

/// How far the end of a side with so many cells falls in the end \[m\].
fn fallen(laboratory: &Laboratory<'_>, of: (MeshKind, u32), long: u32) -> Result<f64> {
    let config = SolverConfig {
        precision: laboratory.precision,
        time_step: STEP,
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        ..SolverConfig::default()
    };
    let model = over_a_bar(laboratory, of, long)?;
    let mut solver = laboratory.backend.create_solver(model, &config)?;
    let mut state = State::default();
    let mut lowest = [0.0; 2];
    for (lowest, steps) in lowest.iter_mut().zip(STEPS) {
        for _ in 0..steps {
            solver.advance(Frame { duration: STEP })?;
        }
        solver.synchronize()?;
        solver.download(&mut state)?;
        *lowest = state.positions.iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
    }
    Ok(lowest[0] - lowest[1])
}

/// A strip over the upper half of a bar along y.
fn over_a_bar(
    laboratory: &Laboratory<'_>,
    (kind, cells): (MeshKind, u32),
    long: u32,
) -> Result<Arc<Model>> {
    let edge = SHORT / f64::from(cells);
    let around = (PI * RADIUS / edge).round() as u32;
    let all = cells + around + long;
    let width = 2.0 * edge;
    let strip = Strip { length: edge * f64::from(all), width, cells: [all, 2], kind, angle: 0.0 };
    let mut mesh = strip.mesh();
    for x in &mut mesh.positions {
        let along = x[0] - SHORT;
        let beyond = along - PI * RADIUS;
        let (sin, cos) = (along / RADIUS).sin_cos();
        [x[0], x[2]] = if along < 0.0 {
            [-RADIUS, along]
        } else if beyond > 0.0 {
            [RADIUS, -beyond]
        } else {
            [-RADIUS * cos, RADIUS * sin]
        };
    }
    let fabric = Fabric {
        area_density: 0.3,
        thickness: DISTANCE,
        damping: USUAL_DAMPING,
        ..stiff_fabric(0.3, 1e-8)
    };
    let material = FabricMaterial {
        fabric,
        rest: RestSource::Pattern { scale: 1.0 },
        aerodynamics: Aerodynamics::default(),
        imperfection: 0.0,
    };
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let bar = Collider {
        name: "bar".into(),
        shape: ColliderShape::Capsule { half_length: width, radius: BAR },
        pose: Pose { translation: [0.0, 0.5 * width, 0.0], rotation: [half, 0.0, 0.0, half] },
        friction: FRICTION * (1.0 - laboratory.flaw.slipperiness),
        restitution: 0.0,
    };
    let model = ModelBuilder::new()
        .gravity([0.0, 0.0, -GRAVITY])
        .field(Field::Drag { rate: [DRAG; 3] })
        .cloth(Cloth {
            name: "strip".into(),
            geometry: Geometry::Mesh(mesh),
            material: material.into(),
            pins: Vec::new(),
            velocity: [0.0; 3],
        })
        .collider(bar)
        .self_contact(SelfContact {
            distance: DISTANCE,
            response: ContactResponse::Triangles { friction: 0.0 },
        })
        .build();
    Ok(Arc::new(model.map_err(Error::Invalid)?))
}
