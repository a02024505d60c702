//! `cloth check`.

use std::io::{Write, stdout};

use cloth::{
    BackendOptions, ClothMaterial, ContactResponse, FoldedBody, Integrator, LinearMethod,
    SceneAudit, SemiImplicitSolve, SpringClass, TimeStepControl, backend_open,
    scene::{CompiledScene, SceneSolver},
};

use crate::{
    arguments::CheckArguments, audit::counts_text, failure::Failure, foreign::hushed,
    memory::needed, passages::passages, say::Shown, scene_source::SceneSource, units::bytes_text,
};

/// Particles up to which methods for small models are no slip.
const SMALL_PARTICLES: usize = 4000;

pub(crate) fn check(arguments: &CheckArguments) -> Result<(), Failure> {
    let source = SceneSource::read(&arguments.scene)?;
    let scene = source.compile(None)?;
    let estimate = needed(&source.scene, &source.options);
    let solver = scene.choice.solver;
    // Names come from the scene.
    let mut out = Shown(stdout().lock());
    writeln!(out, "scene        {}", scene.name)?;
    for (cloth, springs) in scene.simulated().cloths().iter().zip(springs_per_cloth(&scene)) {
        writeln!(
            out,
            "cloth        {}: {} particles, {} triangles, {}",
            cloth.name,
            cloth.particles.len(),
            cloth.triangles.len(),
            if scene.simulated().is_of_fabric(cloth) {
                "of fabric".to_owned()
            } else {
                format!("{springs} springs")
            },
        )?;
    }
    writeln!(out, "colliders    {}", scene.model.colliders().len())?;
    writeln!(out, "pins         {}", scene.simulated().pins().len())?;
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
    if !scene.choice.reason.is_empty() {
        writeln!(out, "chosen       {}", scene.choice.reason)?;
    }
    writeln!(out, "stable       {}", stable_text(&scene, solver))?;
    for cloth in 0..scene.model.cloths().len() {
        writeln!(out, "damping      {}", damping_text(&scene, cloth))?;
    }
    if let Some(name) = &arguments.backend {
        forms(&mut out, name, &scene)?;
    }
    let audit = SceneAudit::new(&scene.model);
    let start = scene.model.initial_state();
    let found = audit.at(&start.positions, &start.colliders, 0.0);
    writeln!(out, "intersecting {}", counts_text(&found))?;
    if let Some(warning) = intersecting_text(&audit, &found) {
        writeln!(out, "warning: {warning}")?;
    }
    for warning in folded_warnings(&audit, usize::MAX) {
        writeln!(out, "warning: {warning}")?;
    }
    for note in &scene.notes {
        writeln!(out, "note: {note}")?;
    }
    for warning in scene.warnings.iter().cloned().chain(warnings(&scene)) {
        writeln!(out, "warning: {warning}")?;
    }
    Ok(())
}

/// The form of each kernel of a backend that has several, and what rules out the faster ones.
fn forms(out: &mut impl Write, name: &str, scene: &CompiledScene) -> Result<(), Failure> {
    let backend = hushed(|| backend_open(name, &BackendOptions::default()))?;
    let choices = backend.forms(scene.simulated(), &scene.config);
    writeln!(out, "backend      {} ({})", backend.info().name, backend.info().device)?;
    if choices.is_empty() {
        writeln!(out, "form         the same for every model")?;
    }
    for choice in choices {
        writeln!(out, "form         {}: {}", choice.phase, choice.form)?;
        for (form, why) in choice.ruled_out {
            writeln!(out, "             not \"{form}\": {why}")?;
        }
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
    let Some(linear) = scene.config.integrator.linear() else { return name.into() };
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

/// Up to which time step the solver is stable.
fn stable_text(scene: &CompiledScene, solver: SceneSolver) -> String {
    let model = scene.simulated();
    let stable = model.stable_time_step_of(&scene.config.integrator);
    match (solver, stable) {
        (SceneSolver::Explicit, Some(stable)) => format!(
            "up to {stable:.3e} s in any shape of the cloth, damping and contact included; as it lies at \
             the start up to {:.3e} s",
            model.stable_time_step_at_rest()
        ),
        (_, Some(stable)) => format!(
            "up to {stable:.3e} s with this contact, drag and air; springs at any time step, which damps \
             what is faster"
        ),
        (_, None) => format!(
            "at any time step, which damps what is faster (explicit: up to {:.3e} s)",
            model.stable_time_step()
        ),
    }
}

/// The damping of the springs of a cloth.
fn damping_text(scene: &CompiledScene, cloth: usize) -> String {
    let springs = scene.model.springs();
    let range = &scene.model.cloths()[cloth];
    if let ClothMaterial::Fabric(material) = &scene.cloths[cloth].material {
        let [stretch, bend] = material.fabric.damping;
        return format!("{}: stretch {stretch:.2e} s, bend {bend:.2e} s", range.name);
    }
    let kinds: Vec<_> = range
        .particles
        .clone()
        .flat_map(|particle| springs.row(particle as usize))
        .map(|spring| springs.kinds()[springs.kind_indices()[spring] as usize])
        .collect();
    let classes = [
        ("stretch", SpringClass::Stretch),
        ("shear", SpringClass::Shear),
        ("bend", SpringClass::Bend),
    ];
    let parts = classes.iter().filter_map(|(name, class)| {
        let damping = kinds.iter().find(|kind| kind.class == *class)?.damping;
        Some(format!("{name} {damping:.2e}"))
    });
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() {
        return format!("{}: no springs", range.name);
    }
    format!("{}: {} N s/m", range.name, parts.join(", "))
}

/// Triangles up to which a run looks for intersections at its start: more take longer than a frame.
const LOOKED_MAX: usize = 300_000;

/// Warnings for cloth that contact of triangles would keep apart, and that intersects at the start, and for bodies that go through themselves, as far as that is
/// soon found.
pub(crate) fn intersecting_warnings(scene: &CompiledScene) -> Vec<String> {
    let model = &scene.model;
    if !model.has_triangle_contact() {
        return Vec::new();
    }
    let audit = SceneAudit::new(model);
    let mut warnings = folded_warnings(&audit, LOOKED_MAX);
    if model.triangles().len() <= LOOKED_MAX {
        let start = model.initial_state();
        let found = audit.at(&start.positions, &start.colliders, 0.0);
        warnings.extend(intersecting_text(&audit, &found));
    }
    warnings
}

fn folded_warnings(audit: &SceneAudit, most: usize) -> Vec<String> {
    let text = |FoldedBody { name, looked, folded, pairs, time, place: [x, y, z] }: &FoldedBody| {
        format!(
            "the body `{name}` goes through itself in {folded} of {looked} shapes, at {time:.3} s with {pairs} pairs of triangles, of which one is near [{x:.3}, {y:.3}, {z:.3}] m of its own frame: cloth that is caught there is pinched; keep its parts apart there, or give `pinch = \"ghost\"`"
        )
    };
    audit.folded_bodies(most).iter().map(text).collect()
}

fn intersecting_text(audit: &SceneAudit, found: &cloth::audit::Intersections) -> Option<String> {
    let pair = audit.describe(found.first.as_ref()?);
    Some(format!(
        "cloth intersects at the start, first {pair}: contact keeps apart what is apart; `contact.recover = true` pulls it apart before"
    ))
}

/// What a scene is allowed to be but is hardly meant to be.
fn warnings(scene: &CompiledScene) -> Vec<String> {
    let mut warnings: Vec<String> = stability_warning(scene).into_iter().collect();
    if scene.config.integrator != Integrator::Explicit {
        warnings.extend(large_step_warnings(scene, &scene.config.integrator));
    }
    let model = scene.simulated();
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

/// What is to be said of a time step that is not stable in any shape. An adaptive one takes care of
/// itself.
pub(crate) fn stability_warning(scene: &CompiledScene) -> Option<String> {
    let time_step = scene.config.time_step;
    // What was chosen for the model is stable.
    if scene.config.time_step_control != TimeStepControl::Fixed || scene.choice.is_chosen_step() {
        return None;
    }
    let model = scene.simulated();
    if scene.config.integrator == Integrator::Explicit {
        let at_rest = model.stable_time_step_at_rest();
        if time_step <= at_rest {
            return None;
        }
        let stable = model.stable_time_step();
        return Some(format!(
            "the time step is {:.2} times that at which the cloth is unstable even as it lies at the start: \
             the simulation will diverge; {stable:.3e} s is stable in any shape",
            time_step / at_rest
        ));
    }
    let stable = model.stable_time_step_of(&scene.config.integrator)?;
    (time_step > stable).then(|| {
        format!(
            "the semi-implicit solver has no matrix for contact by penalty, drag and air: those of this scene it \
             bears up to a time step of {stable:.3e} s, not {time_step:.3e} s; use that, softer contact, \
             response.impulse, or the implicit solver"
        )
    })
}

/// The implicit and the semi-implicit solver bear springs at any time step, but are not accurate, and some
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
    let particles = scene.simulated().particle_count();
    let small = match integrator {
        _ if integrator.linear().is_some_and(|l| l.method == LinearMethod::Direct) => {
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
