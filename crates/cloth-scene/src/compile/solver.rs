//! The settings of the solver in use, and checks of those of all others.

use cloth_core::{
    AdaptiveSettings, ImplicitSettings, Integrator, LinearSettings, MidpointSettings, Model,
    NewtonSettings, SemiImplicitSettings, TimeStepControl,
};

use crate::{Scene, SceneAdaptive, SceneError, SceneImplicit, SceneSemiImplicit, SceneSolver};

use super::Check;

/// A frame of more substeps than this is a slip of the pen, and its plan would fill the memory.
const SUBSTEPS_MAX: f64 = 1e6;

/// Most iterations of a linear solve. A GPU is handed them before it is known how many are needed.
const ITERATIONS_MAX: u32 = 10_000;

/// Most iterations of Newton's method, and most solves of a substep, in each of which the linear solve is done.
const PASSES_MAX: u32 = 100;

/// Most sweeps of the strain limit in a substep.
const SWEEPS_MAX: u32 = 1000;

/// Most halvings of the adaptive time step.
const HALVINGS_MAX: u32 = 20;

/// Checks the settings of all solvers, so that a scene that is good for one is good for each.
pub(super) fn check(scene: &Scene, check: &Check<'_>) -> Result<(), SceneError> {
    let simulation = &scene.simulation;
    for (key, time_step) in [
        ("simulation.time_step", simulation.time_step),
        ("simulation.implicit.time_step", simulation.implicit.time_step),
        ("simulation.semi_implicit.time_step", simulation.semi_implicit.time_step),
        ("simulation.midpoint.time_step", simulation.midpoint.time_step),
    ] {
        let Some(time_step) = time_step else { continue };
        check.positive(key, time_step)?;
        let substeps = substeps(scene, time_step);
        if substeps > SUBSTEPS_MAX {
            let problem = format!(
                "makes {substeps:.0} substeps of a frame: at most {SUBSTEPS_MAX:.0} make sense"
            );
            return Err(check.error(key, &problem));
        }
    }
    let implicit = &simulation.implicit;
    check.share("simulation.implicit.tolerance", implicit.tolerance)?;
    check.share("simulation.implicit.newton_tolerance", implicit.newton_tolerance)?;
    for (key, count, limit) in [
        ("simulation.implicit.iterations", implicit.iterations, ITERATIONS_MAX),
        ("simulation.implicit.newton_iterations", implicit.newton_iterations, PASSES_MAX),
        ("simulation.implicit.constraint_passes", implicit.constraint_passes, PASSES_MAX),
    ] {
        check.count(key, count, limit)?;
    }
    let weight = simulation.midpoint.weight;
    if !(0.5..=1.0).contains(&weight) {
        let key = "simulation.midpoint.weight";
        return Err(check.error(key, &format!("is {weight}: give 0.5 to 1")));
    }
    if let Some(limit) = &simulation.strain_limit {
        check.count("simulation.strain_limit.sweeps", limit.sweeps, SWEEPS_MAX)?;
    }
    simulation.adaptive.as_ref().map_or(Ok(()), |adaptive| adaptive_check(scene, adaptive, check))
}

fn adaptive_check(
    scene: &Scene,
    adaptive: &SceneAdaptive,
    check: &Check<'_>,
) -> Result<(), SceneError> {
    check.positive("simulation.adaptive.strain_max", adaptive.strain_max)?;
    check.at_least_one("simulation.adaptive.grow_after", adaptive.grow_after)?;
    let key = "simulation.adaptive.halvings";
    if adaptive.halvings > HALVINGS_MAX {
        let problem = format!("is {}: give at most {HALVINGS_MAX}", adaptive.halvings);
        return Err(check.error(key, &problem));
    }
    let simulation = &scene.simulation;
    let time_step = simulation.solver_given().and_then(|solver| simulation.time_step_given(solver));
    let Some(time_step) = time_step else { return Ok(()) };
    let shortest = time_step / f64::from(1_u32 << adaptive.halvings.min(31));
    let substeps = substeps(scene, shortest);
    if substeps > SUBSTEPS_MAX {
        let problem = format!(
            "is {}, which can make {substeps:.0} substeps of a frame: at most {SUBSTEPS_MAX:.0} \
             make sense",
            adaptive.halvings
        );
        return Err(check.error(key, &problem));
    }
    Ok(())
}

/// Substeps in a frame.
fn substeps(scene: &Scene, time_step: f64) -> f64 {
    (scene.simulation.frames_per_second * time_step).recip()
}

/// A solver with the settings that the scene has for it.
pub(super) fn integrator(scene: &Scene, solver: SceneSolver) -> Integrator {
    let simulation = &scene.simulation;
    match solver {
        SceneSolver::Explicit => Integrator::Explicit,
        SceneSolver::Implicit => Integrator::Implicit(implicit(&simulation.implicit)),
        SceneSolver::Midpoint => Integrator::Midpoint(MidpointSettings {
            linear: implicit(&simulation.implicit).linear,
            weight: simulation.midpoint.weight,
        }),
        SceneSolver::SemiImplicit => {
            let SceneSemiImplicit { solve, .. } = simulation.semi_implicit;
            Integrator::SemiImplicit(SemiImplicitSettings { solve })
        }
    }
}

const fn implicit(scene: &SceneImplicit) -> ImplicitSettings {
    ImplicitSettings {
        linear: LinearSettings {
            method: scene.linear,
            preconditioner: scene.preconditioner,
            matrix: scene.matrix,
            stop: scene.stop,
            tolerance: scene.tolerance,
            iterations_max: scene.iterations,
            warm_start: scene.warm_start,
        },
        newton: NewtonSettings {
            iterations_max: scene.newton_iterations,
            tolerance: scene.newton_tolerance,
        },
        constraint_passes: scene.constraint_passes,
    }
}

/// Halvings of an implicit step in contact of triangles where a scene does not say it.
const HALVINGS: u32 = 6;

/// Such a step fails where fabric ends this many times as far beyond its length at rest as its limit is, as it then has gone wrong ...
const BEYOND_LIMIT: f64 = 2.0;
/// ... and at least this far.
const STRAIN_LEAST: f64 = 0.5;

/// Whether the time step may change. Implicit steps in contact of triangles are done again, shorter, where a run would end or what it makes of cloth
/// is none: bodies that come fast pinch it, or drive it far beyond its limit. Rigid bodies are stopped instead.
pub(super) fn time_step_control(
    scene: &Scene,
    solver: SceneSolver,
    model: Option<&Model>,
) -> TimeStepControl {
    if let Some(SceneAdaptive { strain_max, halvings, grow_after }) = scene.simulation.adaptive {
        return TimeStepControl::Adaptive(AdaptiveSettings {
            strain_max,
            halvings_max: halvings,
            grow_after,
            ..AdaptiveSettings::default()
        });
    }
    let touches = |model: &&Model| model.has_triangle_contact() && !model.collider_impulses();
    let Some(model) = model.filter(|_| solver == SceneSolver::Implicit).filter(touches) else {
        return TimeStepControl::Fixed;
    };
    let bound = scene.simulation.strain_bound;
    let is_of_fabric = model.cloths().iter().all(|cloth| model.is_of_fabric(cloth));
    let limits = model.elements().fabrics().iter().map(|fabric| fabric.stretch_limit);
    let strain_max = if is_of_fabric {
        (BEYOND_LIMIT * (limits.fold(1.0, f64::max) - 1.0)).max(STRAIN_LEAST).min(bound)
    } else {
        bound
    };
    TimeStepControl::Adaptive(AdaptiveSettings {
        strain_max,
        halvings_max: HALVINGS,
        needs_convergence: false,
        ..AdaptiveSettings::default()
    })
}
