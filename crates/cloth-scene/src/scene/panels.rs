//! Pieces of a flat pattern.

use serde::{Deserialize, Serialize};

use super::SceneRotation;

/// Pieces of a flat pattern, cut from outlines in a file. They are one cloth, which seams join; each piece is also a set of particles, and so is
/// each edge of its outline, called as `front:hem`, or `front:3` for the edge of that number from 0 if it has no name.
///
/// In an SVG file a piece is a path, polygon or rectangle with an `id`, and `data-edges` has the names of its edges in order. In a DXF file it is a closed
/// polyline, called as its layer.
///
/// An SVG file can draw lines in a piece, along which its triangles have edges, for `folds`: open paths, polylines and lines with `data-piece`, the `id` of the
/// piece, and with an `id`, or with `data-line`, which several can share. They are sets called as `front:pleat`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePanels {
    /// The file, relative to the folder of the scene file, with forward slashes.
    pub file: String,
    /// Length that edges of triangles are to have \[m\].
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub edge: f64,
    /// Length of a unit of the file \[m\]; if not given, what the file says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub unit: Option<f64>,
    /// The pieces, at least one.
    pub pieces: Vec<ScenePiece>,
}

/// A piece, and where it is at the start: upright, its right along x and its top along z, seen from where y is negative.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScenePiece {
    /// Name of its outline in the file.
    pub outline: String,
    /// Name of the piece; that of its outline if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Whether it is the mirror image of its outline.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mirror: bool,
    /// Angle of its warp in the drawing \[degrees\], counter-clockwise from the right; 90 if not given.
    #[serde(default = "upright")]
    pub warp: f64,
    /// Whether it is folded at the start along the lines of the `folds` of its cloth, which have to cross it from border to border; it is flat if not given.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub folded: bool,
    /// Radius of the upright cylinder that it is wrapped on \[m\], whose axis is behind it; it stays flat if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub radius: Option<f64>,
    /// Rotation about the middle of the piece; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<SceneRotation>,
    /// Where the middle of the piece is \[m\].
    #[serde(default)]
    pub translation: [f64; 3],
}

const fn upright() -> f64 {
    90.0
}
