//! Spans of time with settings of their own.

use cloth_core::{Integrator, SolverConfig};

use crate::{Scene, SceneError};

use super::Check;

/// A span of time with settings of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledPhase {
    /// Its name.
    pub name: String,
    /// The first frame after it.
    pub end: u64,
    /// Gravity \[m/s^2\], if it is another one than that of the scene.
    pub gravity: Option<[f64; 3]>,
    /// How many times as stiff fabric bends.
    pub bending: f64,
    /// Settings for the solver.
    pub config: SolverConfig,
}

pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    config: &SolverConfig,
) -> Result<Vec<CompiledPhase>, SceneError> {
    let mut phases = Vec::with_capacity(scene.phases.len());
    let mut time = 0.0;
    for (index, phase) in scene.phases.iter().enumerate() {
        let key = format!("phase[{index}]");
        check.positive(&format!("{key}.duration"), phase.duration)?;
        let start = (time * scene.simulation.frames_per_second).round() as u64;
        time += phase.duration;
        let end = (time * scene.simulation.frames_per_second).round() as u64;
        if end <= start {
            let problem = format!(
                "is {} s, less than half a frame: a phase takes at least one",
                phase.duration
            );
            return Err(check.error(&format!("{key}.duration"), &problem));
        }
        if let Some(gravity) = &phase.gravity {
            check.finite(&format!("{key}.gravity"), gravity)?;
        }
        let mut config = config.clone();
        if let Some(time_step) = phase.time_step {
            check.positive(&format!("{key}.time_step"), time_step)?;
            config.time_step = time_step;
        }
        let bending = phase.bending.unwrap_or(1.0);
        check.positive(&format!("{key}.bending"), bending)?;
        if bending > 1.0 && matches!(config.integrator, Integrator::Explicit) {
            let problem = "is above 1, and explicit steps are as long as bending without it allows: use the implicit solver";
            return Err(check.error(&format!("{key}.bending"), problem));
        }
        let (name, gravity) = (phase.name.clone(), phase.gravity);
        phases.push(CompiledPhase { name, end, gravity, bending, config });
    }
    Ok(phases)
}
