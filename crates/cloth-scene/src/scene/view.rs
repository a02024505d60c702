//! The camera for pictures.

use cloth_core::StrainMeasure;
use serde::{Deserialize, Serialize};

/// A camera, upright with z up.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneView {
    /// Where the camera is \[m\].
    pub eye: [f64; 3],
    /// What it looks at \[m\].
    pub target: [f64; 3],
    /// Vertical field of view \[degrees\], above 0 and below 180; 40 if not given.
    #[serde(default = "field_of_view_default")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 180.0)))]
    pub field_of_view: f64,
    /// Colours of cloth by how far it is stretched, in place of its own: the relative elongation that is shown in red, such as 0.1, above 0. The larger
    /// principal stretch of fabric less 1; length of springs over that at rest less 1. Cloth has its colour if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub strain: Option<f64>,
    /// What `strain` shows of fabric: `stretch`, or the size of the Green strain along the `warp`, along the `weft`, or of `shear` between them; `stretch` if not
    /// given. Springs have stretch alone.
    #[serde(default, skip_serializing_if = "is_stretch")]
    pub strain_of: SceneStrain,
    /// Lines on fabric along its warp (dark) and its weft (light); springs have none. False if not given.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub threads: bool,
    /// Dust that shows how the air moves; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dust: Option<SceneDust>,
}

/// A strain that colours of cloth show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SceneStrain {
    /// The larger principal stretch less 1.
    #[default]
    Stretch,
    /// |E11|.
    Warp,
    /// |E22|.
    Weft,
    /// |E12|.
    Shear,
}

impl From<SceneStrain> for StrainMeasure {
    fn from(strain: SceneStrain) -> Self {
        match strain {
            SceneStrain::Stretch => Self::Stretch,
            SceneStrain::Warp => Self::Warp,
            SceneStrain::Weft => Self::Weft,
            SceneStrain::Shear => Self::Shear,
        }
    }
}

fn is_stretch(strain: &SceneStrain) -> bool {
    *strain == SceneStrain::Stretch
}

/// Dust in pictures. Its grains go with the air of the fields with an expression: at the velocity at which these
/// exert no force. They have no weight and act on nothing.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneDust {
    /// Number of grains, dimensionless.
    #[cfg_attr(test, schemars(range(min = 1, max = 100_000)))]
    pub count: u32,
    /// Corner of the box in which grains begin \[m\].
    pub min: [f64; 3],
    /// The corner opposite to it \[m\].
    pub max: [f64; 3],
    /// Time after which a grain begins anew \[s\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 60.0)))]
    pub lifetime: f64,
}

impl SceneDust {
    /// Most grains.
    pub(crate) const COUNT_LIMIT: u32 = 100_000;
    /// Longest lifetime \[s\].
    pub(crate) const LIFETIME_LIMIT: f64 = 60.0;
}

const fn field_of_view_default() -> f64 {
    40.0
}
