//! A piece that turns freely, in motion and not at rest.

use cloth_core::{
    Frame, ImplicitSettings, Integrator, MidpointSettings, Model, Result, SolverConfig, State,
};
use std::sync::Arc;

use super::{Experiment, meshes, poplin};
use crate::{Curve, CurveStyle, Flaw, Laboratory, MeshKind, Outcome, Plot, meshes::Strip};

pub(super) const FREE_SPIN: Experiment = Experiment {
    name: "free-spin",
    title: "A piece turns freely about the axis of its plane for 5 s, in steps of 1/60 s of the midpoint integrator: what is left of its angular momentum",
    source: "all of it: nothing acts on the piece",
    control: Flaw { fabric: None, pattern_growth: 0.0, is_damped: true, slipperiness: 0.0 },
    run,
};

/// Length and width of the piece \[m\].
const SIZE: [f64; 2] = [0.3, 0.2];

/// Rate at the start \[rad/s\].
const RATE: f64 = 6.0;

/// Steps, and length of each \[s\].
const STEPS: (u32, f64) = (300, 1.0 / 60.0);

fn run(laboratory: &Laboratory<'_>) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    let mut plot = Plot {
        title: "Free spin".into(),
        axes: ["time [s]".into(), "angular momentum [%]".into()],
        curves: vec![Curve {
            name: "kept".into(),
            style: CurveStyle::Line,
            points: vec![[0.0, 100.0], [5.0, 100.0]],
        }],
        ..Plot::default()
    };
    for (kind, cells) in meshes(laboratory, [9, 18]) {
        let [length, width] = SIZE;
        let strip = Strip { length, width, cells: [cells, cells * 2 / 3], kind, angle: 0.3 };
        let model = laboratory.model(strip.mesh(), poplin(), [0.0; 3], |_| false)?;
        let curve = spin(laboratory, &model)?;
        let left = curve.last().map_or(f64::NAN, |point| point[1]);
        outcome.value("angular momentum", (kind, cells), "%", left, [100.0, 0.05]);
        if kind != MeshKind::Alternating {
            let name = format!("{} {cells}", kind.name());
            plot.curves.push(Curve { name, points: curve, ..Curve::default() });
        }
    }
    outcome.plots.push(plot);
    Ok(outcome)
}

/// Time \[s\] and angular momentum \[%\], five times a second.
fn spin(laboratory: &Laboratory<'_>, model: &Arc<Model>) -> Result<Vec<[f64; 2]>> {
    let integrator = if laboratory.flaw.is_damped {
        Integrator::Implicit(ImplicitSettings::default())
    } else {
        Integrator::Midpoint(MidpointSettings::default())
    };
    let (steps, length) = STEPS;
    let config = SolverConfig {
        precision: laboratory.precision,
        time_step: length,
        integrator,
        ..SolverConfig::default()
    };
    let mut solver = laboratory.backend.create_solver(Arc::clone(model), &config)?;
    let mut state = model.initial_state();
    let centre = centre(model, &state);
    for (x, v) in state.positions.iter().zip(&mut state.velocities) {
        *v = [-RATE * (x[1] - centre[1]), RATE * (x[0] - centre[0]), 0.0];
    }
    solver.upload(&state)?;
    let start = momentum(model, &state);
    let mut curve = vec![[0.0, 100.0]];
    for step in 1..=steps {
        solver.advance(Frame { duration: length })?;
        solver.synchronize()?;
        if step % 12 == 0 {
            solver.download(&mut state)?;
            curve.push([f64::from(step) * length, 100.0 * momentum(model, &state) / start]);
        }
    }
    Ok(curve)
}

/// The centre of mass \[m\].
fn centre(model: &Model, state: &State) -> [f64; 3] {
    let mass: f64 = model.masses().iter().sum();
    let all = || model.masses().iter().zip(&state.positions);
    [0, 1, 2].map(|k| all().map(|(m, x)| m * x[k]).sum::<f64>() / mass)
}

/// Angular momentum about the vertical axis through it \[kg m^2/s\].
fn momentum(model: &Model, state: &State) -> f64 {
    let [a, b, _] = centre(model, state);
    let all = model.masses().iter().zip(state.positions.iter().zip(&state.velocities));
    all.map(|(m, (x, v))| m * ((x[0] - a) * v[1] - (x[1] - b) * v[0])).sum()
}
