//! The table of forms: what special forms of kernels take. What is not listed goes to the general form.

use cloth_core::{Feature, FeatureSet, FormChoice, Integrator, Model, ModelFeatures, SolverConfig};

use crate::{contact::policy::GROUPS_WIDE, dispatch::GROUP};

/// `explicit_substep_crews.wgsl`: four threads for each particle of a model of few groups that is in contact with itself.
pub(crate) const SUBSTEP_CREWS: FeatureSet = FeatureSet::of(&[
    Feature::Springs,
    Feature::Buckling,
    Feature::Air,
    Feature::PenaltyContact,
    Feature::StrainLimit,
    Feature::Colliders,
    Feature::ColliderImpulses,
    Feature::ProceduralFields,
    Feature::AnyMesh,
    Feature::UnlikeSprings,
]);

/// `implicit_system.wgsl` and `implicit_motion.wgsl`: one kernel before the iterations of an implicit substep, and one after them.
pub(crate) const IMPLICIT_STEP: FeatureSet = FeatureSet::of(&[
    Feature::Springs,
    Feature::Buckling,
    Feature::Air,
    Feature::ColliderImpulses,
    Feature::AnyMesh,
    Feature::UnlikeSprings,
]);

/// They in words.
const EXPLICIT_FORM: &str = "few groups, with contact";
const IMPLICIT_FORM: &str = "one kernel before the iterations and one after them";
const GENERAL: &str = "general";

/// Whether a form with these features takes a model.
pub(crate) fn takes(form: FeatureSet, model: &Model, config: &SolverConfig) -> bool {
    ModelFeatures::new(model, config).set().first_beyond(form).is_none()
}

/// The forms that a model gets.
pub(crate) fn choices(model: &Model, config: &SolverConfig) -> Vec<FormChoice> {
    let features = ModelFeatures::new(model, config).set();
    let groups: usize =
        model.cloths().iter().map(|cloth| cloth.particles.len().div_ceil(GROUP as usize)).sum();
    let beyond = |form| features.first_beyond(form).map(|feature| feature.name().to_owned());
    let choice = |phase, special, objection: Option<String>| match objection {
        Some(why) => FormChoice { phase, form: GENERAL, ruled_out: vec![(special, why)] },
        None => FormChoice { phase, form: special, ruled_out: Vec::new() },
    };
    match config.integrator {
        Integrator::Explicit => {
            let objection = beyond(SUBSTEP_CREWS).or_else(|| {
                if !features.has(Feature::PenaltyContact) {
                    Some(format!("no {}", Feature::PenaltyContact.name()))
                } else if groups > GROUPS_WIDE as usize {
                    Some(format!("{groups} groups of particles, more than {GROUPS_WIDE}"))
                } else {
                    None
                }
            });
            vec![choice("explicit_substep", EXPLICIT_FORM, objection)]
        }
        Integrator::Implicit(_) => {
            vec![choice("implicit_substep", IMPLICIT_FORM, beyond(IMPLICIT_STEP))]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, ContactResponse, GridPatch, MaterialPreset, ModelBuilder, SelfContact,
    };

    use super::*;

    /// The page about this backend has this table.
    #[test]
    fn the_page_has_the_table() {
        let page = include_str!("../BACKEND.md");
        for (phase, form, takes) in [
            ("explicit_substep", EXPLICIT_FORM, SUBSTEP_CREWS),
            ("implicit_substep", IMPLICIT_FORM, IMPLICIT_STEP),
        ] {
            let names = takes.iter().map(Feature::name).collect::<Vec<_>>().join(", ");
            let rows = format!(
                "| `{phase}` | {form} | {names} |\n| `{phase}` | {GENERAL} | everything |\n"
            );
            assert!(page.contains(&rows), "{rows}");
        }
    }

    #[test]
    fn what_a_form_does_not_list_goes_to_the_general_one() {
        let patch = GridPatch::horizontal(8, 0.02, 0.0);
        let cloth = Cloth::grid("cloth", patch, &MaterialPreset::JERSEY);
        let response = ContactResponse::Impulse { restitution: 0.0, friction: 0.3 };
        let model = ModelBuilder::new().cloth(cloth.clone()).build().unwrap();
        let contact = SelfContact { distance: 0.01, response };
        let touching = ModelBuilder::new().cloth(cloth).self_contact(contact).build().unwrap();
        let config = SolverConfig::default();
        assert!(takes(SUBSTEP_CREWS, &model, &config));
        assert!(!takes(SUBSTEP_CREWS, &touching, &config));
        let choice = &choices(&touching, &config)[0];
        assert_eq!(choice.form, "general");
        assert_eq!(choice.ruled_out[0].1, Feature::ImpulseContact.name());
    }
}
