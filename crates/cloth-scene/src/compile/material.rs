//! From presets and changes to a material.

use cloth_core::{
    Aerodynamics, BendModel, Geometry, Mass, Material, MaterialPreset, SpringClass,
    SpringCoefficients,
};

use crate::{MeasuredFabric, SceneBend, SceneError, SceneMass, SceneMaterial, SceneSpring};

use super::Check;

/// What stands in a material for springs that none is of.
const NONE: SpringCoefficients = SpringCoefficients { stiffness: 1.0, damping: 0.0 };

/// The material at `key` of what has this geometry.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    scene: &SceneMaterial,
    geometry: &Geometry,
) -> Result<Material, SceneError> {
    let spacing = geometry.spacing();
    // Springs of a network can have values of their own.
    let takes = |class: SpringClass| match geometry {
        Geometry::Network(network) => {
            let mut all = network.springs.iter();
            all.any(|spring| spring.class == class && spring.coefficients.is_none())
        }
        Geometry::Grid(_) | Geometry::Mesh(_) => true,
    };
    let preset = match &scene.preset {
        Some(name) => Some(preset(check, key, name)?.material(spacing)),
        None => None,
    };
    let missing = |name: &str| {
        let problem = format!("has no `{name}`: give it, or a `preset`");
        check.error(key, &problem)
    };
    let mass = scene
        .mass
        .map(|mass| match mass {
            SceneMass::PerArea(value) => Mass::PerArea(value),
            SceneMass::PerParticle(value) => Mass::PerParticle(value),
        })
        .or(preset.map(|preset| preset.mass))
        .ok_or_else(|| missing("mass.per_area"))?;
    let spring = |(class, name): (SpringClass, &str),
                  given: Option<SceneSpring>,
                  base: Option<SpringCoefficients>| {
        let given = given.unwrap_or_default();
        let base = base.or_else(|| (!takes(class)).then_some(NONE));
        let stiffness = given
            .stiffness
            .or(base.map(|base| base.stiffness))
            .ok_or_else(|| missing(&format!("{name}.stiffness")))?;
        let damping = given.damping.or(base.map(|base| base.damping));
        let mass = match mass {
            Mass::PerArea(value) => value * spacing * spacing,
            Mass::PerParticle(value) => value,
        };
        let usual = || SpringCoefficients::with_usual_damping(stiffness, mass).damping;
        Ok(SpringCoefficients { stiffness, damping: damping.unwrap_or_else(usual) })
    };
    let air = preset.map_or_else(Aerodynamics::default, |preset| preset.aerodynamics);
    let given_air = scene.aerodynamics.unwrap_or_default();
    Ok(Material {
        mass,
        stretch: spring(
            (SpringClass::Stretch, "stretch"),
            scene.stretch,
            preset.map(|preset| preset.stretch),
        )?,
        shear: spring(
            (SpringClass::Shear, "shear"),
            scene.shear,
            preset.map(|preset| preset.shear),
        )?,
        bend: spring(
            (SpringClass::Bend, "bend"),
            scene
                .bend
                .map(|SceneBend { stiffness, damping, .. }| SceneSpring { stiffness, damping }),
            preset.map(|preset| preset.bend),
        )?,
        bend_model: scene
            .bend
            .and_then(|bend| bend.rigidity)
            .map(|rigidity| BendModel::ImmediateBuckling { rigidity })
            .or(preset.map(|preset| preset.bend_model))
            .unwrap_or_default(),
        aerodynamics: Aerodynamics {
            pressure: given_air.pressure.unwrap_or(air.pressure),
            friction: given_air.friction.unwrap_or(air.friction),
        },
        thickness: scene
            .thickness
            .or(preset.map(|preset| preset.thickness))
            .ok_or_else(|| missing("thickness"))?,
    })
}

fn preset(check: &Check<'_>, key: &str, name: &str) -> Result<&'static MaterialPreset, SceneError> {
    MaterialPreset::find(name).ok_or_else(|| {
        if MeasuredFabric::find(name).is_ok() {
            let problem =
                format!("`{name}` is a fabric that springs do not have: give `model = \"fabric\"`");
            return check.error(&format!("{key}.preset"), &problem);
        }
        MeasuredFabric::unknown(check.place(&format!("{key}.preset")), "material preset", name)
    })
}
