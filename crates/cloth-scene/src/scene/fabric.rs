//! Cloth of triangles: by what model a cloth is simulated, and where its pattern comes from.

use serde::{Deserialize, Serialize};

use super::{SceneCloth, SceneGeometry};
use crate::MeasuredFabric;

/// What holds a cloth together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneModel {
    /// Triangles that stretch and bend as the fabric does in the laboratory, however the cloth is meshed.
    Fabric,
    /// Springs between particles, whose effect depends on the mesh.
    Springs,
}

impl SceneCloth {
    /// The model of this cloth: the one that the scene gives. Else fabric for a laboratory sheet and for a preset, but
    /// springs where a preset that springs have as well is followed by what only these have; and springs for all else.
    #[must_use]
    pub fn model_chosen(&self) -> SceneModel {
        let material = &self.material;
        let is_network = matches!(self.geometry, SceneGeometry::Network(_));
        match (self.model, &material.preset) {
            (Some(model), _) => model,
            _ if is_network => SceneModel::Springs,
            _ if material.sheet.is_some() => SceneModel::Fabric,
            (None, Some(preset)) if cloth_core::MaterialPreset::find(preset).is_some() => {
                let is_of_springs = material.springs_key().is_some() || self.stencil_is_given();
                if is_of_springs { SceneModel::Springs } else { SceneModel::Fabric }
            }
            (None, Some(preset)) if MeasuredFabric::find(preset).is_ok() => SceneModel::Fabric,
            _ => SceneModel::Springs,
        }
    }

    /// Whether a grid has another stencil than the usual one, which springs alone have.
    pub(crate) fn stencil_is_given(&self) -> bool {
        matches!(&self.geometry, SceneGeometry::Grid(grid) if grid.stencil != super::SceneStencil::default())
    }
}

/// How the cells of a grid of fabric are divided into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum SceneMeshing {
    /// Diagonals in turns.
    Alternating,
    /// A particle more in the middle of each cell, and four triangles around it.
    UnionJack,
    /// All diagonals one way.
    OneWay,
}

/// Where the shape of a cloth of fabric without forces comes from, and how its threads run.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePattern {
    /// `uv`: the flat pattern that the texture coordinates of a mesh are, u along the warp; `shape` (the default): the mesh as it lies in
    /// space, folds included. A grid has its columns and rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<ScenePatternSource>,
    /// Length of a unit of the texture coordinates \[m\]; 1 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub scale: Option<f64>,
    /// Direction of the warp in space for `shape`, of any length, as it lies in each triangle; if not given, the axis of the world
    /// along which the mesh is longest, or the next one in triangles on which that stands up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// Angle of the warp \[degrees\], counter-clockwise from u, from the columns of a grid or from `axis`; 0 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warp: Option<f64>,
    /// How far folds at rest are off, at random \[degrees\], as no fabric is perfectly flat: what is would be pressed together within its plane
    /// instead of buckling. 0.06 if not given, which nobody sees; 0 for experiments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub imperfection: Option<f64>,
    /// Panels that are cut at other angles, or of another fabric.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub panels: Vec<ScenePanel>,
}

/// Where a pattern comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ScenePatternSource {
    /// Texture coordinates.
    Uv,
    /// The mesh as it lies in space.
    Shape,
}

/// A panel of a mesh.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePanel {
    /// Group of the mesh whose triangles it has: those with all corners in it. Where groups overlap the first panel counts.
    pub group: String,
    /// Angle of its warp \[degrees\], as `warp` of the pattern; that of the pattern if not given. Pieces of `geometry.panels` have their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warp: Option<f64>,
    /// Another fabric than that of the cloth: one that `cloth fabrics` lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// How many layers of its fabric lie on each other here, as in a collar: mass, stiffness and rigidity are as many times as large; 1 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub layers: Option<u32>,
}

/// Damping of fabric, a time by which its stiffness is multiplied.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneFabricDamping {
    /// For stretching and shearing \[s\]; 2e-5 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub stretch: Option<f64>,
    /// For bending \[s\]; 1e-3 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub bend: Option<f64>,
}
