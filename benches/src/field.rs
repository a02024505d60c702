//! What it costs to write a field as an expression: the drag of the common workload as one, beside the built-in one.

use std::time::Instant;

use cloth::{
    Backend, Frame, Result, Solver, State,
    scene::{BenchKind, CompileOptions, SceneField, bench_scene},
};

use crate::{FRAMES_BEFORE, FRAMES_MEASURED, median};

/// Frames that are enqueued before the device is waited for.
const FRAMES_IN_A_ROW: usize = 10;

/// The drag of the workload, 0.5 1/s.
const DRAG: &str = "-0.5 * m * v";

/// Time of a frame without self-contact, a median.
#[derive(Clone, Copy, Debug)]
pub struct FieldCost {
    /// With the built-in field \[s\].
    pub built_in: f64,
    /// With the expression \[s\].
    pub expression: f64,
    /// Largest difference of a coordinate at the end, relative to the side of the cloth.
    pub deviation: f64,
}

impl FieldCost {
    /// What the expression costs more, as a share.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.expression / self.built_in - 1.0
    }
}

struct Run {
    solver: Box<dyn Solver>,
    times: Vec<f64>,
}

/// Measures both on a patch of `side` x `side` particles, in turns, so that what else happens on the machine
/// happens to both.
///
/// # Errors
/// What the backend reports.
///
/// # Panics
/// If the built-in scene does not compile, which its tests exclude.
pub fn field_cost(backend: &dyn Backend, side: u32) -> Result<FieldCost> {
    let start = |fields: Option<Vec<SceneField>>| -> Result<(Run, Frame)> {
        let mut scene = bench_scene(BenchKind::Sphere, side, false);
        scene.fields = fields.unwrap_or(scene.fields);
        let compiled =
            scene.compile(&CompileOptions::default()).expect("the workload is a valid scene");
        let frame = Frame::per_second(compiled.frames_per_second);
        let solver = backend.create_solver(compiled.model, &compiled.config)?;
        Ok((Run { solver, times: Vec::new() }, frame))
    };
    let (built_in, frame) = start(None)?;
    let (expression, _) = start(Some(vec![SceneField::Expression(DRAG.into())]))?;
    let mut runs = [built_in, expression];
    for row in 0..(FRAMES_BEFORE + FRAMES_MEASURED) / FRAMES_IN_A_ROW {
        for run in &mut runs {
            run.solver.synchronize()?;
            let start = Instant::now();
            for _ in 0..FRAMES_IN_A_ROW {
                run.solver.advance(frame)?;
            }
            run.solver.synchronize()?;
            if row * FRAMES_IN_A_ROW >= FRAMES_BEFORE {
                run.times.push(start.elapsed().as_secs_f64() / FRAMES_IN_A_ROW as f64);
            }
        }
    }
    let mut states = [State::default(), State::default()];
    for (run, state) in runs.iter_mut().zip(&mut states) {
        run.solver.download(state)?;
    }
    let [built_in, expression] = runs.map(|mut run| median(&mut run.times));
    let [a, b] = states.map(|state| state.positions);
    let differences = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs());
    let width = f64::from(side.max(2) - 1) * 0.02;
    Ok(FieldCost { built_in, expression, deviation: differences.fold(0.0, f64::max) / width })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_compute_the_same() {
        let backend = cloth::backend_create("cpu", None).unwrap();
        let cost = field_cost(&*backend, 8).unwrap();
        assert!(cost.built_in > 0.0 && cost.expression > 0.0);
        assert!(cost.deviation < 1e-2, "{cost:?}");
    }
}
