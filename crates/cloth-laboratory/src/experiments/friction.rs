//! Cloth that lies and slides: friction with a floor and with other cloth, in motion and at rest.

use std::sync::Arc;

use cloth_core::{
    Aerodynamics, Cloth, Collider, ColliderShape, ContactResponse, Error, FabricMaterial, Frame,
    Geometry, ImplicitSettings, Integrator, Model, ModelBuilder, Pose, RestSource, Result,
    SelfContact, SolverConfig, State,
};

use super::{Experiment, GRAVITY, poplin};
use crate::{Curve, CurveStyle, Flaw, Laboratory, MeshKind, Outcome, Plot, meshes::Strip};

pub(super) const FRICTION: Experiment = Experiment {
    name: "friction",
    title: "Cloth on a floor that slopes, with one on top of it, and cloth thrown onto cloth, in steps of 1/60 s of the implicit integrator",
    source: "Coulomb's law: what holds is still, and what slides has the acceleration g (sin - mu cos); a sheet stops after v^2 / (2 mu g)",
    control: Flaw { fabric: None, pattern_growth: 0.0, is_damped: false, slipperiness: 0.1 },
    run,
};

/// Tangent of the slope.
const SLOPE: f64 = 0.5;
/// Distance at which contact begins \[m\].
const DISTANCE: f64 = 2e-3;
/// Side of a sheet \[m\].
const SIDE: f64 = 0.1;
/// Length of a step \[s\].
const STEP: f64 = 1.0 / 60.0;
/// The same where a way is measured, of which backward Euler loses the speed times half of it \[m\].
const SHORT_STEP: f64 = 1.0 / 480.0;
/// Steps in which sheets come to lie.
const SETTLING: u32 = 60;
/// Speed of the sheet that is thrown \[m/s\], and friction with what it lands on.
const THROW: (f64, f64) = (0.8, 0.3);

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let seconds = if laboratory.is_full() { 60 } else { 5 };
    let (speed, rough) = THROW;
    let mut plot = Plot {
        title: "A sheet slides on another one until it stops".into(),
        axes: ["time [s]".into(), "way [m]".into()],
        curves: vec![Curve {
            name: "theory".into(),
            style: CurveStyle::Line,
            points: braking_curve(speed, rough),
        }],
        ..Plot::default()
    };
    for (kind, cells) in super::meshes(laboratory, [6, 12]) {
        let of = (kind, cells);
        // Sheets that are not quite flat press on each other at angles, and stick a little less.
        for (layers, percent) in [(1, 2), (3, 10)] {
            let friction = (1.0 + 0.01 * f64::from(percent)) * SLOPE;
            let model = pile(laboratory, of, (layers, friction))?;
            let way = ways(laboratory, &model, STEP, SETTLING + 60 * seconds)?;
            let drift = 1e6 * (way[way.len() - 1] - way[SETTLING as usize]).abs();
            let name =
                format!("drift in {seconds} s, mu {percent} % above the slope, {layers} layers");
            outcome.between(name, of, "um", drift, [f64::NEG_INFINITY, 10.0]);
        }
        let friction = 0.7 * SLOPE;
        let model = pile(laboratory, of, (1, friction))?;
        let way = ways(laboratory, &model, STEP, SETTLING + 60)?;
        let [from, to] = [SETTLING as usize, way.len() - 1];
        let gained = (way[to] - way[to - 1]) - (way[from] - way[from - 1]);
        let acceleration = gained / STEP / (STEP * (to - from) as f64);
        let expected = GRAVITY * slope_cosine() * (SLOPE - friction);
        outcome.value("acceleration", of, "m/s^2", acceleration, [expected, 0.02]);

        let model = thrown(laboratory, of)?;
        let way = ways(laboratory, &model, SHORT_STEP, 240)?;
        let expected = speed * speed / (2.0 * rough * GRAVITY);
        outcome.value("way until it stops", of, "m", way[way.len() - 1], [expected, 0.02]);
        if kind != MeshKind::Alternating && cells == 6 {
            let points =
                way.iter().zip(1_u32..).map(|(x, step)| [SHORT_STEP * f64::from(step), *x]);
            plot.curves.push(Curve {
                name: kind.name().into(),
                points: points.collect(),
                ..Curve::default()
            });
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}

fn slope_cosine() -> f64 {
    (1.0 + SLOPE * SLOPE).sqrt().recip()
}

/// Way of what brakes by friction, twenty points until it has stopped and two of what stays.
fn braking_curve(speed: f64, friction: f64) -> Vec<[f64; 2]> {
    let stop = speed / (friction * GRAVITY);
    let at = |time: f64| {
        let time = time.min(stop);
        speed * time - 0.5 * friction * GRAVITY * time * time
    };
    (0..=20).map(|k| stop * f64::from(k) / 20.0).chain([0.6]).map(|time| [time, at(time)]).collect()
}

/// A sheet of some length that lies at a height \[m\], its middle `aside` from the origin along x.
fn sheet(
    name: String,
    (length, height, aside): (f64, f64, f64),
    (kind, cells): (MeshKind, u32),
) -> Cloth {
    let long = (f64::from(cells) * length / SIDE) as u32;
    let strip = Strip { length, width: SIDE, cells: [long, cells], kind, angle: 0.0 };
    let mut mesh = strip.mesh();
    for [x, y, z] in &mut mesh.positions {
        (*x, *y, *z) = (*x - 0.5 * length + aside, *y - 0.5 * SIDE, height);
    }
    let material = FabricMaterial {
        fabric: poplin(),
        rest: RestSource::Pattern { scale: 1.0 },
        aerodynamics: Aerodynamics::default(),
        imperfection: 0.0,
    };
    let (material, geometry) = (material.into(), Geometry::Mesh(mesh));
    Cloth { name, geometry, material, pins: Vec::new(), velocity: [0.0; 3] }
}

fn contact(friction: f64) -> SelfContact {
    SelfContact { distance: DISTANCE, response: ContactResponse::Triangles { friction } }
}

/// Sheets one on the other on a floor, and a field that pulls as if it sloped.
fn pile(
    laboratory: &Laboratory<'_>,
    of: (MeshKind, u32),
    (layers, friction): (u32, f64),
) -> Result<Arc<Model>> {
    let friction = friction * (1.0 - laboratory.flaw.slipperiness);
    let pull = GRAVITY * slope_cosine();
    let floor = Collider {
        name: "floor".into(),
        shape: ColliderShape::Plane,
        pose: Pose::default(),
        friction,
        restitution: 0.0,
    };
    let builder = ModelBuilder::new()
        .gravity([SLOPE * pull, 0.0, -pull])
        .collider(floor)
        .self_contact(contact(friction));
    let builder = (0..layers).fold(builder, |builder, layer| {
        let height = DISTANCE * (0.5 + f64::from(layer));
        let aside = 1.3e-3 * f64::from(layer);
        builder.cloth(sheet(format!("layer {layer}"), (SIDE, height, aside), of))
    });
    Ok(Arc::new(builder.build().map_err(Error::Invalid)?))
}

/// A sheet that is thrown along a long one, which is held.
fn thrown(laboratory: &Laboratory<'_>, of: (MeshKind, u32)) -> Result<Arc<Model>> {
    let (speed, friction) = THROW;
    let mut above = sheet("thrown".into(), (SIDE, DISTANCE, 0.0), of);
    above.velocity = [speed, 0.0, 0.0];
    let mut below = sheet("held".into(), (4.0 * SIDE, 0.0, SIDE), of);
    below.pins = (0..(4 * of.1 + 1) * (of.1 + 1)).collect();
    let model = ModelBuilder::new()
        .gravity([0.0, 0.0, -GRAVITY])
        .cloth(above)
        .cloth(below)
        .self_contact(contact(friction * (1.0 - laboratory.flaw.slipperiness)))
        .build();
    Ok(Arc::new(model.map_err(Error::Invalid)?))
}

/// Where the middle of the first sheet is along x after each step \[m\].
fn ways(
    laboratory: &Laboratory<'_>,
    model: &Arc<Model>,
    time_step: f64,
    steps: u32,
) -> Result<Vec<f64>> {
    let config = SolverConfig {
        precision: laboratory.precision,
        time_step,
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        ..SolverConfig::default()
    };
    let mut solver = laboratory.backend.create_solver(Arc::clone(model), &config)?;
    let count = model.cloths()[0].particles.len();
    let mut state = State::default();
    let steps = (0..steps).map(|_| {
        solver.advance(Frame { duration: time_step })?;
        solver.synchronize()?;
        solver.download(&mut state)?;
        Ok(state.positions[..count].iter().map(|x| x[0]).sum::<f64>() / count as f64)
    });
    steps.collect()
}
