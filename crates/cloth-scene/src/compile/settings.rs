//! The settings that belong to the scene as a whole.

use std::sync::Arc;

use cloth_core::{
    Air, ContactResponse, ContactRule, Field, FieldAxes, FieldError, FieldProgram, Gust, Model,
    ModelBuilder, Pinch, Precision, SelfContact, SolverConfig, SpringClass, StrainLimit,
};

use crate::{
    CompiledCloth, Scene, SceneContact, SceneContactResponse, SceneContactRule, SceneDust,
    SceneError, SceneField, ScenePinch, ScenePrecision, SceneSolver, SceneSpringClass, SceneView,
    SolverChoice,
};

use super::{Check, model_error, solver};

/// Checks what is said of the simulation as a whole, before anything is built.
pub(super) fn simulation_check(scene: &Scene, check: &Check<'_>) -> Result<(), SceneError> {
    let simulation = &scene.simulation;
    if simulation.frames == 0 {
        return Err(check.error("simulation.frames", "is 0: give at least one frame"));
    }
    check.positive("simulation.frames_per_second", simulation.frames_per_second)?;
    solver::check(scene, check)?;
    contact_check(scene, check)?;
    // All but the choice is there already.
    let choice = SolverChoice {
        solver: SceneSolver::Explicit,
        time_step: 1.0,
        reason: String::new(),
        is_chosen_step: false,
    };
    solver_config(scene, &choice, None).map(|_| ())
}

/// The settings of the solver that was chosen.
pub(super) fn solver_config(
    scene: &Scene,
    choice: &SolverChoice,
    model: Option<&Model>,
) -> Result<SolverConfig, SceneError> {
    let simulation = &scene.simulation;
    let strain_limit = simulation.strain_limit.as_ref().map(|limit| StrainLimit {
        ratio: limit.ratio,
        sweeps: limit.sweeps,
        classes: limit.classes.iter().map(|&class| spring_class(class)).collect(),
    });
    let config = SolverConfig {
        precision: precision(scene),
        time_step: choice.time_step,
        time_step_control: solver::time_step_control(scene, choice.solver, model),
        integrator: solver::integrator(scene, choice.solver),
        strain_limit,
        strain_bound: simulation.strain_bound,
        pinch: pinch(scene),
        ..SolverConfig::default()
    };
    config.validate().map_err(|error| model_error::place(scene, error))?;
    Ok(config)
}

fn pinch(scene: &Scene) -> Pinch {
    match scene.contact.as_ref().map(|contact| contact.pinch).unwrap_or_default() {
        ScenePinch::Refuse => Pinch::Refuse,
        ScenePinch::Ghost => Pinch::Ghost,
    }
}

const fn spring_class(class: SceneSpringClass) -> SpringClass {
    match class {
        SceneSpringClass::Stretch => SpringClass::Stretch,
        SceneSpringClass::Shear => SpringClass::Shear,
        SceneSpringClass::Bend => SpringClass::Bend,
    }
}

/// The precision of the arithmetic.
pub(super) const fn precision(scene: &Scene) -> Precision {
    match scene.simulation.precision {
        ScenePrecision::F32 => Precision::F32,
        ScenePrecision::F64 => Precision::F64,
    }
}

/// A procedural field from the text at `key`.
fn procedural(
    check: &Check<'_>,
    key: &str,
    source: &str,
    axes: FieldAxes,
) -> Result<Field, SceneError> {
    let program = FieldProgram::compile_in(source, axes).map_err(|error| {
        let FieldError { line, column, problem } = &error;
        check.error(key, &format!("at its line {line}, column {column}: {problem}"))
    })?;
    Ok(Field::Procedural { program: Arc::new(program) })
}

/// Adds gravity, fields and air.
pub(super) fn surroundings(
    scene: &Scene,
    check: &Check<'_>,
    mut builder: ModelBuilder,
) -> Result<ModelBuilder, SceneError> {
    builder = builder.gravity(scene.gravity);
    for (index, field) in scene.fields.iter().enumerate() {
        builder = builder.field(match field {
            &SceneField::Uniform { acceleration } => Field::Uniform { acceleration },
            &SceneField::Drag { rate } => Field::Drag { rate },
            SceneField::Expression(source) => {
                procedural(check, &format!("field[{index}].expression"), source, FieldAxes::Engine)?
            }
            SceneField::ExpressionLeftHanded(source) => {
                let key = format!("field[{index}].expression_left_handed");
                procedural(check, &key, source, FieldAxes::LeftHanded)?
            }
        });
    }
    if let Some(wind) = &scene.wind {
        builder = builder.air(Air {
            density: wind.density,
            wind_velocity: wind.velocity,
            gust: wind
                .gust
                .map(|gust| Gust { amplitude: gust.amplitude, frequency: gust.frequency }),
        });
    }
    Ok(builder)
}

/// What is wrong with the contact, before anything is built.
fn contact_check(scene: &Scene, check: &Check<'_>) -> Result<(), SceneError> {
    let Some(contact) = &scene.contact else { return Ok(()) };
    let is_of_triangles = matches!(contact.response, SceneContactResponse::Triangles { .. });
    let asked = [
        ("pinch", contact.pinch != ScenePinch::Refuse),
        ("recover", contact.recover),
        ("rule", !contact.rules.is_empty()),
    ];
    if let Some((key, _)) = asked.into_iter().find(|(_, is_given)| *is_given && !is_of_triangles) {
        let problem = "is of contact of triangles: leave `response` out, or take this key out";
        return Err(check.error(&format!("contact.{key}"), problem));
    }
    if contact.response == SceneContactResponse::None && contact.distance.is_some() {
        let problem = "is of contact, and the response is \"none\": take one of the two out";
        return Err(check.error("contact.distance", problem));
    }
    if contact.distance.is_none()
        && !is_of_triangles
        && contact.response != SceneContactResponse::None
    {
        let problem =
            "needs `distance`, the distance of two particles below which they touch \\[m\\]";
        return Err(check.error("contact", problem));
    }
    Ok(())
}

/// A rule of contact.
pub(super) fn contact_rule(rule: &SceneContactRule) -> ContactRule {
    let SceneContactRule { between, distance, friction, forces } = rule.clone();
    ContactRule { between, distance, friction, without_forces: !forces }
}

/// Contact of cloths, and what is worth knowing of it if it was chosen.
pub(super) fn contact(
    scene: &Scene,
    cloths: &[CompiledCloth],
    notes: &mut Vec<String>,
) -> Option<SelfContact> {
    let contact = scene.contact_chosen()?;
    let response = match contact.response {
        SceneContactResponse::None => return None,
        SceneContactResponse::Impulse { restitution, friction } => {
            ContactResponse::Impulse { restitution, friction }
        }
        SceneContactResponse::Penalty { stiffness, damping } => {
            ContactResponse::Penalty { stiffness, damping }
        }
        SceneContactResponse::Triangles { friction } => ContactResponse::Triangles { friction },
    };
    let spacing = cloths.iter().map(|cloth| cloth.spacing).fold(f64::INFINITY, f64::min);
    let thickness = cloths.iter().map(|cloth| cloth.material.thickness()).fold(0.0, f64::max);
    let distance =
        contact.distance.unwrap_or_else(|| SceneContact::usual_distance(spacing, thickness));
    let chosen = SelfContact { distance, response };
    if contact.distance.is_none() {
        notes.push(format!(
            "contact of triangles at {:.2} mm with a friction of {}: `contact.distance` and `contact.response` change it, and \
             `contact.response = \"none\"` leaves it out",
            1e3 * distance,
            chosen.friction(),
        ));
    }
    Some(chosen)
}

pub(super) fn view_check(view: &SceneView, check: &Check<'_>) -> Result<(), SceneError> {
    check.finite("view.eye", &view.eye)?;
    check.finite("view.target", &view.target)?;
    check.positive("view.field_of_view", view.field_of_view)?;
    if view.field_of_view >= 180.0 {
        return Err(check.error("view.field_of_view", "must be less than 180 degrees"));
    }
    if let Some(strain) = view.strain {
        check.positive("view.strain", strain)?;
    }
    if view.eye == view.target {
        return Err(check.error("view.target", "is where the eye is: move one of them"));
    }
    if let Some(dust) = &view.dust {
        check.count("view.dust.count", dust.count, SceneDust::COUNT_LIMIT)?;
        check.finite("view.dust.min", &dust.min)?;
        check.finite("view.dust.max", &dust.max)?;
        check.positive("view.dust.lifetime", dust.lifetime)?;
        if dust.lifetime > SceneDust::LIFETIME_LIMIT {
            return Err(check.error("view.dust.lifetime", "must be at most 60 s"));
        }
    }
    Ok(())
}
