//! The settings that belong to the scene as a whole.

use std::sync::Arc;

use cloth_core::{
    Air, ContactResponse, Field, FieldAxes, FieldError, FieldProgram, Gust, ModelBuilder, Pinch,
    Precision, SelfContact, SolverConfig, SpringClass, StrainLimit,
};

use crate::{
    Scene, SceneContactResponse, SceneDust, SceneError, SceneField, ScenePinch, ScenePrecision,
    SceneSolver, SceneSpringClass, SceneView, SolverChoice,
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
    // All but the choice is there already.
    let choice = SolverChoice {
        solver: SceneSolver::Explicit,
        time_step: 1.0,
        reason: String::new(),
        is_chosen_step: false,
    };
    solver_config(scene, &choice).map(|_| ())
}

/// The settings of the solver that was chosen.
pub(super) fn solver_config(
    scene: &Scene,
    choice: &SolverChoice,
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
        time_step_control: solver::time_step_control(scene),
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

/// Adds gravity, fields, air and contact.
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
    if let Some(contact) = &scene.contact {
        let is_of_triangles = matches!(contact.response, SceneContactResponse::Triangles { .. });
        if contact.pinch != ScenePinch::Refuse && !is_of_triangles {
            let problem = "is of contact of triangles: leave `response` out, or take this key out";
            return Err(check.error("contact.pinch", problem));
        }
        let response = match contact.response {
            SceneContactResponse::Impulse { restitution, friction } => {
                ContactResponse::Impulse { restitution, friction }
            }
            SceneContactResponse::Penalty { stiffness, damping } => {
                ContactResponse::Penalty { stiffness, damping }
            }
            SceneContactResponse::Triangles { friction } => ContactResponse::Triangles { friction },
        };
        builder = builder.self_contact(SelfContact { distance: contact.distance, response });
    }
    Ok(builder)
}

pub(super) fn view_check(view: &SceneView, check: &Check<'_>) -> Result<(), SceneError> {
    check.finite("view.eye", &view.eye)?;
    check.finite("view.target", &view.target)?;
    check.positive("view.field_of_view", view.field_of_view)?;
    if view.field_of_view >= 180.0 {
        return Err(check.error("view.field_of_view", "must be less than 180 degrees"));
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
