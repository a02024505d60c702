//! `cloth check`.

use std::io::{Write, stdout};

use cloth::{
    ContactResponse, Integrator, LinearMethod, SemiImplicitSolve, TimeStepControl,
    scene::{CompiledScene, SceneSolver},
};

use crate::{
    arguments::CheckArguments, failure::Failure, passages::passages, scene_source::SceneSource,
    units::bytes_text,
};

/// Share of the stable time step above which a scene runs without a margin.
const STABLE_SHARE: f64 = 0.9;

/// Particles up to which methods for small models are no slip.
const SMALL_PARTICLES: usize = 4000;

pub(crate) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let source = SceneSource::read(&arguments.scene)?;
    let scene = source.compile(None)?;
    let estimate = source.scene.memory_estimate(&source.options);
    let solver = source.scene.simulation.solver;
    let mut out = stdout().lock();
    writeln!(out, "scene        {}", scene.name)?;
    for (cloth, springs) in scene.model.cloths().iter().zip(springs_per_cloth(&scene)) {
        writeln!(
            out,
            "cloth        {}: {} particles, {} triangles, {springs} springs",
            cloth.name,
            cloth.particles.len(),
            cloth.triangles.len(),
        )?;
    }
    writeln!(out, "colliders    {}", scene.model.colliders().len())?;
    writeln!(out, "pins         {}", scene.model.pins().len())?;
    writeln!(
        out,
        "frames       {} at {} per second, {:.3} s",
        scene.frames,
        scene.frames_per_second,
        f64::from(scene.frames) / scene.frames_per_second,
    )?;
    writeln!(out, "memory       about {}", bytes_text(estimate.bytes))?;
    writeln!(
        out,
        "solver       {}, precision {}",
        solver_text(&scene, solver),
        scene.config.precision
    )?;
    let adaptive = match scene.config.time_step_control {
        TimeStepControl::Adaptive(settings) => {
            format!(", halved up to {} times where needed", settings.halvings_max)
        }
        TimeStepControl::Fixed => String::new(),
    };
    writeln!(out, "time step    {:.3e} s{adaptive}", scene.config.time_step)?;
    let stable_time_step = scene.model.stable_time_step();
    if solver == SceneSolver::Explicit {
        writeln!(out, "stable       up to about {stable_time_step:.3e} s (2/omega_max)")?;
    } else {
        writeln!(
            out,
            "stable       at any time step, which damps what is faster (explicit: up to about \
             {stable_time_step:.3e} s)"
        )?;
    }
    for warning in warnings(&scene, stable_time_step) {
        writeln!(out, "warning: {warning}")?;
    }
    Ok(())
}

fn springs_per_cloth(scene: &CompiledScene) -> Vec<usize> {
    let mut counts = vec![0; scene.model.cloths().len()];
    for spring in scene.model.springs().iter() {
        counts[scene.model.cloth_of(spring.particles[0])] += 1;
    }
    counts
}

/// The solver, with what it solves systems by.
fn solver_text(scene: &CompiledScene, solver: SceneSolver) -> String {
    let name = solver.name();
    let Integrator::Implicit(settings) = &scene.config.integrator else { return name.into() };
    let linear = &settings.linear;
    match linear.method {
        LinearMethod::ConjugateGradient => format!(
            "{name}, cg with preconditioner {}, tolerance {}, at most {} iterations",
            linear.preconditioner, linear.tolerance, linear.iterations_max
        ),
        LinearMethod::Jacobi => format!(
            "{name}, jacobi, tolerance {}, at most {} iterations",
            linear.tolerance, linear.iterations_max
        ),
        method => format!("{name}, {method}"),
    }
}

/// What a scene is allowed to be but is hardly meant to be.
fn warnings(scene: &CompiledScene, stable_time_step: f64) -> Vec<String> {
    let mut warnings = match &scene.config.integrator {
        Integrator::Explicit => explicit_warnings(scene, stable_time_step),
        integrator => large_step_warnings(scene, integrator),
    };
    let model = &scene.model;
    // The impulse response leaves neighbours out.
    let penalty = |response| matches!(response, ContactResponse::Penalty { .. });
    if let Some(contact) = model.self_contact().filter(|contact| penalty(contact.response)) {
        let rest_length = model
            .springs()
            .iter()
            .map(|spring| model.springs().kinds()[spring.kind as usize].rest_length);
        let shortest = rest_length.fold(f64::INFINITY, f64::min);
        if contact.distance > shortest {
            warnings.push(format!(
                "the contact distance {} m is larger than the shortest spring, {shortest:.4} m: \
                 neighbours push each other apart; use a smaller distance",
                contact.distance
            ));
        }
    }
    warnings.extend(passages(model));
    let floats = model.uniform_acceleration() == [0.0; 3];
    if model.pins().is_empty() && model.colliders().is_empty() && !floats {
        warnings.push(
            "nothing holds or stops the cloth: it falls out of view; add pins or a collider".into(),
        );
    }
    warnings
}

/// An adaptive time step takes care of itself.
fn explicit_warnings(scene: &CompiledScene, stable_time_step: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    let time_step = scene.config.time_step;
    if scene.config.time_step_control != TimeStepControl::Fixed {
        return warnings;
    }
    if time_step > stable_time_step {
        warnings.push(format!(
            "the time step is {:.2} times the stable one: the simulation will diverge; use a \
             smaller time step or softer springs",
            time_step / stable_time_step
        ));
    } else if time_step > STABLE_SHARE * stable_time_step {
        warnings.push(format!(
            "the time step is {:.0} % of the stable one: contact or stretching can make the \
             simulation diverge; stay below {:.0} %",
            100.0 * time_step / stable_time_step,
            100.0 * STABLE_SHARE,
        ));
    }
    warnings
}

/// The implicit and the semi-implicit solver are stable at any time step, but not accurate, and some
/// of their methods are made for small models.
fn large_step_warnings(scene: &CompiledScene, integrator: &Integrator) -> Vec<String> {
    let mut warnings = Vec::new();
    let frame = scene.frames_per_second.recip();
    if scene.config.time_step > frame * (1.0 + 1e-9) {
        warnings.push(format!(
            "the time step is longer than a frame: each frame is one substep of {frame:.3e} s; use \
             a time step of at most that"
        ));
    }
    let particles = scene.model.particle_count();
    let small = match integrator {
        Integrator::Implicit(settings) if settings.linear.method == LinearMethod::Direct => {
            Some(("the method direct factorises a matrix in every substep", "the method cg"))
        }
        Integrator::SemiImplicit(settings) if settings.solve == SemiImplicitSolve::DenseInverse => {
            Some(("the solve dense-inverse takes n^2 numbers and operations", "factorisation"))
        }
        _ => None,
    };
    if let Some((problem, mend)) = small.filter(|_| particles > SMALL_PARTICLES) {
        warnings.push(format!("{problem}, which is slow for {particles} particles; use {mend}"));
    }
    warnings
}
