//! What a cloth is made of: a preset, numbers of one's own, or a preset with changes.

use serde::{Deserialize, Serialize};

use super::SceneFabricDamping;

/// A material. What is not given comes from the preset, or from a laboratory sheet; without both, mass, thickness and the
/// stiffness of every class of springs must be given, dampings are a twentieth of the critical ones and the
/// coefficients of the air are those of a flat plate.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMaterial {
    /// Name of a fabric: for `model = "fabric"` one that `cloth fabrics` lists, for springs one of
    /// [`MaterialPreset::ALL`](cloth_core::MaterialPreset::ALL); `denim`, `jersey`, `jet-set`, `ponte-roma` and `rib-knit` are both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// File with the sheet of a laboratory, relative to the folder of the scene file; a cloth of fabric instead of a preset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    /// Damping of fabric.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<SceneFabricDamping>,
    /// Thickness of the cloth \[m\]: colliders stop its particles at half of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub thickness: Option<f64>,
    /// Largest principal stretch of fabric, a length over that at rest: 1.1 lets nothing stretch by more than a tenth, 100 is
    /// hardly any limit. That of the preset is 1.28, or more where the fabric was measured farther.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 1.001)))]
    pub stretch_limit: Option<f64>,
    /// How mass is given to the particles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<SceneMass>,
    /// Springs along the threads or edges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<SceneSpring>,
    /// Springs across the diagonals of a grid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear: Option<SceneSpring>,
    /// Springs that resist folding.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bend: Option<SceneBend>,
    /// Coefficients of the force of the air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aerodynamics: Option<SceneAerodynamics>,
    /// Where fabric is stiffer, heavier, more damped, thicker or rougher than elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub maps: Vec<SceneMap>,
}

/// A property of fabric that is not the same everywhere.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMap {
    /// Attribute of the vertices of the mesh, painted from 0 to 1, as `pins` have them; or a set of particles, which is 1 in it and 0 elsewhere. A triangle
    /// has the mean of its corners.
    pub by: String,
    /// The property.
    pub of: SceneMapOf,
    /// Factors of the property where the map is 0, and where it is 1.
    #[cfg_attr(test, schemars(inner(range(min = 1e-6))))]
    pub range: [f64; 2],
}

/// A property that a map changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneMapOf {
    /// Stiffness against stretching and shearing.
    Stretch,
    /// Bending rigidity.
    Bend,
    /// Mass per area.
    Mass,
    /// Damping of stretching and bending.
    Damping,
    /// Distance at which contact of triangles begins; two sides have the mean of both. It is not in steps.
    Thickness,
    /// Friction of contact of triangles; two sides have the product of both. It is not in steps.
    Friction,
}

impl SceneMaterial {
    /// A key that is given and that springs alone have.
    pub(crate) fn springs_key(&self) -> Option<&'static str> {
        let mass = matches!(self.mass, Some(SceneMass::PerParticle(_)));
        let keys = [
            ("stretch", self.stretch.is_some()),
            ("shear", self.shear.is_some()),
            ("bend", self.bend.is_some()),
            ("mass.per_particle", mass),
        ];
        keys.into_iter().find_map(|(key, is_given)| is_given.then_some(key))
    }
}

/// How mass is given to the particles.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SceneMass {
    /// Mass per area \[kg/m^2\].
    PerArea(#[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))] f64),
    /// The same mass for every particle \[kg\].
    PerParticle(#[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))] f64),
}

/// Stiffness and damping of one class of springs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneSpring {
    /// Stiffness \[N/m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: Option<f64>,
    /// Damping along the spring \[N s/m\]; if neither this nor a preset is given, a twentieth of the critical damping of a particle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
}

/// Springs that resist folding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneBend {
    /// Stiffness \[N/m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: Option<f64>,
    /// Damping along the spring \[N s/m\]; if neither this nor a preset is given, a twentieth of the critical damping of a particle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
    /// Flexural rigidity of one spring \[N m^2\]: with it, springs under compression buckle. See
    /// [`BendModel::ImmediateBuckling`](cloth_core::BendModel::ImmediateBuckling) for how to choose
    /// it, and the stiffness that it needs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub rigidity: Option<f64>,
}

/// Coefficients of the force of the air on a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneAerodynamics {
    /// Pressure drag coefficient, dimensionless; 1.28 for a flat plate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub pressure: Option<f64>,
    /// Skin friction coefficient, dimensionless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub friction: Option<f64>,
}
