//! One cloth of a scene.

use serde::{Deserialize, Serialize};

use super::{
    SceneColour, SceneMaterial, SceneMeshing, SceneModel, SceneNetwork, ScenePanels, ScenePattern,
    ScenePin, SceneRotation, SceneTriangles,
};

/// One cloth.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneCloth {
    /// Name, unique among the cloths; `cloth`, `cloth 2`, `cloth 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// `fabric` or `springs`; if not given, fabric where `material` has a sheet or a preset, unless it or the grid says what only springs have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<SceneModel>,
    /// Velocity of all its particles at the start \[m/s\]; zero if not given.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Colour in pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<SceneColour>,
    /// Particles held in place from the start.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pins: Vec<ScenePin>,
    /// Particles and springs.
    pub geometry: SceneGeometry,
    /// Shape without forces and direction of the warp, of fabric.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<ScenePattern>,
    /// Gas under pressure inside it, if it is closed or will be sewn up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inflate: Option<SceneInflation>,
    /// When it tears, of fabric; it never does if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tear: Option<SceneTear>,
    /// Where it belongs if it intersects another cloth that has a layer, and `contact.recover` pulls them apart: the one of the higher layer in front
    /// of the other one, where triangles are seen counterclockwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<u32>,
    /// Where it is folded at rest, such as pleats, of fabric.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub folds: Vec<SceneFold>,
    /// What it is made of.
    pub material: SceneMaterial,
}

/// Lines along which fabric is folded at rest: it bends as if it had been pressed there.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneFold {
    /// Sets of particles, as pins have them: edges of triangles with both ends in one of them are folded. Of a grid `column-7`, of panels a line that
    /// their file draws in a piece, `front:pleat`.
    pub lines: Vec<String>,
    /// Angle by which it is folded \[degrees\]: 0 is flat, 180 back onto itself; positive with the side inwards where triangles are seen
    /// counterclockwise, negative with the other one.
    #[cfg_attr(test, schemars(range(min = -180.0, max = 180.0)))]
    pub angle: f64,
}

/// How a cloth tears: along the edges of its triangles. Each triangle of it has vertices of its own in what is written.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneTear {
    /// How much longer a thread of warp or weft becomes before it breaks, dimensionless: its breaking elongation. Of cotton .05 to .1, of wool .3.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub strain: f64,
}

/// Gas under pressure inside a cloth, which is where its triangles do not face. Backends cpu and reference have it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneInflation {
    /// Pressure above that outside \[Pa\].
    pub pressure: f64,
    /// When it begins to rise, and when it is there \[s\]; [0, 0] if not given.
    #[serde(default)]
    pub rise: [f64; 2],
}

/// Where the particles and springs come from.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneGeometry {
    /// A rectangular patch.
    Grid(SceneGrid),
    /// A triangle mesh from a file.
    Mesh(SceneMesh),
    /// A triangle mesh in the scene itself.
    Triangles(SceneTriangles),
    /// Pieces of a flat pattern, cut from outlines in an SVG or DXF file.
    Panels(ScenePanels),
    /// Particles and springs without a surface.
    Network(SceneNetwork),
}

/// A rectangular patch of particles. Particle (column i, row j) has index j columns + i.
///
/// Exactly one of `spacing` and `size` is given, and at most one of `origin` and `centre`; with
/// neither, the patch is centred on the origin of the world.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneGrid {
    /// Particles along the column axis, at least 2.
    #[cfg_attr(test, schemars(range(min = 2)))]
    pub columns: u32,
    /// Particles along the row axis, at least 2.
    #[cfg_attr(test, schemars(range(min = 2)))]
    pub rows: u32,
    /// Distance of neighbouring particles along both axes \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub spacing: Option<f64>,
    /// Side lengths along the column and the row axis \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// Position of particle 0 \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
    /// Position of the middle of the patch \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 3]>,
    /// Direction in which the column index grows, of any length; (1, 0, 0) if not given.
    #[serde(default = "axis_x")]
    pub column_axis: [f64; 3],
    /// Direction in which the row index grows, of any length, at a right angle to the column axis;
    /// (0, 1, 0) if not given.
    #[serde(default = "axis_y")]
    pub row_axis: [f64; 3],
    /// Neighbours that each particle is joined to by springs: 12 (the default) or 24.
    #[serde(default)]
    pub stencil: SceneStencil,
    /// How its cells are divided into triangles, of fabric: `alternating` (the default), `union-jack` or `one-way`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meshing: Option<SceneMeshing>,
}

impl SceneGrid {
    /// A patch with this distance of neighbours \[m\] in the plane z = 0, centred on the origin.
    #[must_use]
    pub fn new(columns: u32, rows: u32, spacing: f64) -> Self {
        Self {
            columns,
            rows,
            spacing: Some(spacing),
            size: None,
            origin: None,
            centre: None,
            column_axis: axis_x(),
            row_axis: axis_y(),
            stencil: SceneStencil::default(),
            meshing: None,
        }
    }
}

/// The neighbours of a grid particle that it is joined to; a number in files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(extend("enum" = [12, 24])))]
#[serde(try_from = "u32", into = "u32")]
pub enum SceneStencil {
    /// 4 stretch, 4 shear on the diagonals, 4 bend that skip one particle.
    #[default]
    Neighbours12,
    /// All of the surrounding block of 5 x 5.
    Neighbours24,
}

impl TryFrom<u32> for SceneStencil {
    type Error = String;

    fn try_from(neighbours: u32) -> Result<Self, String> {
        match neighbours {
            12 => Ok(Self::Neighbours12),
            24 => Ok(Self::Neighbours24),
            _ => Err(format!("a stencil of {neighbours} neighbours does not exist: use 12 or 24")),
        }
    }
}

impl From<SceneStencil> for u32 {
    fn from(stencil: SceneStencil) -> Self {
        match stencil {
            SceneStencil::Neighbours12 => 12,
            SceneStencil::Neighbours24 => 24,
        }
    }
}

/// A triangle mesh from a file. It is scaled, then rotated, then translated.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneMesh {
    /// The file, relative to the folder of the scene file, with forward slashes.
    pub file: String,
    /// Factor on all coordinates, above zero; 1 if not given.
    #[serde(default = "one")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub scale: f64,
    /// Rotation about the origin of the mesh; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Translation \[m\]; none if not given.
    #[serde(default)]
    pub translation: [f64; 3],
}

const fn one() -> f64 {
    1.0
}

const fn axis_x() -> [f64; 3] {
    [1.0, 0.0, 0.0]
}

const fn axis_y() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}
