//! Where cloths are sewn.

use serde::{Deserialize, Serialize};

/// A seam: vertices of a cloth, or of two, that are drawn together and then are one.
///
/// Its stitches are given by exactly one of `stitches`, `points`, `lines` and `file`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneSeam {
    /// Name, unique among the seams; `seam`, `seam 2`, `seam 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// The cloth that it is in; if not given, the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloth: Option<String>,
    /// The cloth of the second vertex of each of `stitches`, if it is another one. Such a seam is held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
    /// Pairs of vertices, from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stitches: Vec<[u32; 2]>,
    /// Vertices, each sewn to a point on an edge. The edge gets a vertex there, unless one is near.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<SceneSeamPoint>,
    /// Two lines along the borders of panels, sewn end to end. Each is a list of vertex groups that follow one another. Their numbers of vertices
    /// can differ: both get vertices where the other has some.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lines: Option<[Vec<String>; 2]>,
    /// Whether the second line runs the other way than that in which the ends are nearer to each other.
    #[serde(default, skip_serializing_if = "is_false")]
    pub reverse: bool,
    /// How many times as long as the other the longer line is, which is gathered; 1 if not given. Lines that differ by 5 % more are
    /// refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 1.0)))]
    pub gather: Option<f64>,
    /// Whether its stitches are those that the mesh file of the cloth has in lines `stitch`.
    #[serde(default, skip_serializing_if = "is_false")]
    pub file: bool,
    /// Which seams of the file, from 0 in the order of its lines `seam`; if not given, all that no other seam names. So some can close after others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub file_seams: Vec<u32>,
    /// When it begins to close and when it is closed \[s\]; [0, 1] if not given.
    #[serde(default = "first_second")]
    pub close: [f64; 2],
    /// Stiffness of each stitch \[N/m\]; 100 if not given.
    #[serde(default = "hundred")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: f64,
    /// Damping of each stitch \[N s/m\]; critical if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(range(min = 0.0)))]
    pub damping: Option<f64>,
    /// What becomes of it once it is closed.
    #[serde(default)]
    pub end: SceneSeamEnd,
    /// Force per length \[N/m\] at which the stitches of a seam that is held break, once it is closed: some 2,000 and more for
    /// seams of clothes, a few hundred for basted ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub strength: Option<f64>,
}

/// What becomes of a seam once it is closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneSeamEnd {
    /// The vertices of each stitch become one, with the mass and momentum of both, as soon as no stitch that is to be welded is wider than 1 mm.
    #[default]
    Weld,
    /// The springs of the stitches hold it.
    Hold,
}

/// A vertex that is sewn to a point on an edge.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneSeamPoint {
    /// The vertex, from 0.
    pub vertex: u32,
    /// The ends of the edge, from 0.
    pub edge: [u32; 2],
    /// Where the point is, from 0 at the first end to 1 at the second.
    #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
    pub place: f64,
}

/// An elastic band along borders of panels, such as a waistband: springs from vertex to vertex that draw the border together.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneElastic {
    /// Name, unique among elastic bands, seams and attachments; `elastic`, `elastic 2`, `elastic 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// The cloth that it is in; if not given, the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cloth: Option<String>,
    /// Vertex groups along the border, each of which it follows from end to end. Where seams join these the band goes on.
    pub line: Vec<String>,
    /// Length of the band without forces in units of that of the border, above 0 to 1.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0), range(max = 1.0)))]
    pub ratio: f64,
    /// Stiffness \[N\]: the force that would stretch it to twice its length.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub stiffness: f64,
    /// When it begins to contract and when it has its length \[s\]; [0, 1] if not given.
    #[serde(default = "first_second")]
    pub close: [f64; 2],
}

/// Another run to start from.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneStart {
    /// Folder of a run whose cloths have as many particles, such as `out/drape`, from the folder of the scene file or the current one. Cloths start as
    /// they lie and move at its checkpoint, their seams welded if they are there.
    pub from: String,
}

/// A span of time with settings of its own. Phases follow one another from the start of the scene; after the last one that scene goes on
/// as it is.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePhase {
    /// Name, for messages; `phase`, `phase 2`, `phase 3` and so on if not given.
    #[serde(default)]
    pub name: String,
    /// How long it takes \[s\]; it ends with the frame that ends nearest to that.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub duration: f64,
    /// Gravity \[m/s^2\], if it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<[f64; 3]>,
    /// Time step \[s\], if it is another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time_step: Option<f64>,
    /// How many times as stiff fabric bends: panels that are stiff while they are sewn do not wrinkle at their seams; 1 if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub bending: Option<f64>,
}

const fn first_second() -> [f64; 2] {
    [0.0, 1.0]
}

const fn hundred() -> f64 {
    100.0
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
const fn is_false(value: &bool) -> bool {
    !*value
}
