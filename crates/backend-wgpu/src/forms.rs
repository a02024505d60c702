//! The table of forms: what special forms of kernels take. What is not listed goes to the general form.

use cloth_core::{Feature, FeatureSet, FormChoice, Integrator, Model, ModelFeatures, SolverConfig};

use crate::{dispatch::iterates_at_once, tables::links::LinkTables};

/// `conjugate_gradient_iteration.wgsl`: an iteration of conjugate gradients in one kernel, where springs join particles of near numbers.
pub(crate) const ITERATION: FeatureSet = FeatureSet::all_but(&[
    Feature::Fabric,
    Feature::PenaltyContact,
    Feature::TriangleContact,
    Feature::DoublePrecision,
]);

/// It in words.
const ITERATION_FORM: &str = "an iteration in one kernel";
const GENERAL: &str = "general";
const PHASE: &str = "conjugate_gradient";

/// Whether an iteration is one kernel on a device with so much workgroup memory \[bytes\]; or why not.
pub(crate) fn iteration(
    model: &Model,
    config: &SolverConfig,
    links: &LinkTables,
    memory: u32,
) -> Result<(), String> {
    let features = ModelFeatures::new(model, config).set();
    if let Some(feature) = features.first_beyond(ITERATION) {
        return Err(feature.name().to_owned());
    }
    if iterates_at_once(model.particle_count() as u32, links.reach, memory) {
        Ok(())
    } else {
        Err("particles of far numbers are joined, or there are many".into())
    }
}

/// The forms that a model gets.
pub(crate) fn choices(model: &Model, config: &SolverConfig, memory: u32) -> Vec<FormChoice> {
    match config.integrator {
        Integrator::Explicit => {
            vec![FormChoice { phase: "explicit_substep", form: GENERAL, ruled_out: Vec::new() }]
        }
        Integrator::Implicit(_) => {
            let objection = iteration(model, config, &LinkTables::new(model), memory).err();
            let form = if objection.is_some() { GENERAL } else { ITERATION_FORM };
            let ruled_out = objection.into_iter().map(|why| (ITERATION_FORM, why)).collect();
            vec![FormChoice { phase: PHASE, form, ruled_out }]
        }
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use cloth_core::{
        Cloth, ContactResponse, GridPatch, ImplicitSettings, MaterialPreset, ModelBuilder,
        SelfContact,
    };

    use super::*;

    /// The page about this backend has this table.
    #[test]
    fn the_page_has_the_table() {
        let page = include_str!("../BACKEND.md");
        let names = ITERATION.iter().map(Feature::name).collect::<Vec<_>>().join(", ");
        let rows = format!(
            "| `{PHASE}` | {ITERATION_FORM} | {names} |\n| `{PHASE}` | {GENERAL} | everything |\n"
        );
        assert!(page.contains(&rows), "{rows}");
    }

    #[test]
    fn what_a_form_does_not_list_goes_to_the_general_one() {
        let cloth = |side| {
            Cloth::grid("cloth", GridPatch::horizontal(side, 0.02, 0.0), &MaterialPreset::JERSEY)
        };
        let response = ContactResponse::Penalty { stiffness: 10.0, damping: 0.0 };
        let contact = SelfContact { distance: 0.01, response };
        let small = ModelBuilder::new().cloth(cloth(8)).build().unwrap();
        let large = ModelBuilder::new().cloth(cloth(200)).build().unwrap();
        let touching = ModelBuilder::new().cloth(cloth(8)).self_contact(contact).build().unwrap();
        let integrator = Integrator::Implicit(ImplicitSettings::default());
        let config = SolverConfig { integrator, ..SolverConfig::default() };
        let of = |model: &Model| choices(model, &config, 16 << 10).remove(0);
        assert_eq!((of(&small).form, of(&small).ruled_out.len()), (ITERATION_FORM, 0));
        assert_eq!((of(&large).form, of(&large).ruled_out.len()), (GENERAL, 1));
        assert_eq!(of(&touching).ruled_out[0].1, Feature::PenaltyContact.name());
    }
}
