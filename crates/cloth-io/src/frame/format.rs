//! Names of the output formats.

use std::fmt;
use std::str::FromStr;

/// A format that frames can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum FrameFormat {
    /// Wavefront OBJ, one text file per frame.
    Obj,
    /// Polygon File Format, one binary file per frame.
    Ply,
    /// VTK unstructured grid, one binary file per frame, and a `.pvd` collection with the times.
    Vtu,
    /// Pictures, one file per frame.
    Png,
    /// Binary glTF 2.0 with the frames as animated morph targets, one file `.glb`.
    Gltf,
    /// Point Cache 2, one file.
    Pc2,
    /// LightWave Motion Designer point cache, one file.
    Mdd,
    /// NumPy archive, one file.
    Npz,
    /// Animated GIF, one file.
    Gif,
    /// Animated PNG, one file.
    Apng,
}

impl FrameFormat {
    /// All formats.
    pub const ALL: [Self; 10] = [
        Self::Obj,
        Self::Ply,
        Self::Vtu,
        Self::Png,
        Self::Gltf,
        Self::Pc2,
        Self::Mdd,
        Self::Npz,
        Self::Gif,
        Self::Apng,
    ];

    /// Name as users write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Vtu => "vtu",
            Self::Png => "png",
            Self::Gltf => "gltf",
            Self::Pc2 => "pc2",
            Self::Mdd => "mdd",
            Self::Npz => "npz",
            Self::Gif => "gif",
            Self::Apng => "apng",
        }
    }

    /// File name extension, without the dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Gltf => "glb",
            // Viewers and browsers know animated PNG by the extension of PNG.
            Self::Apng => "png",
            other => other.name(),
        }
    }

    /// Name of the file of frame `index` of a sequence that is called `name`.
    pub(super) fn file_name(self, name: &str, index: u64) -> String {
        format!("{name}_{index:06}.{}", self.extension())
    }

    /// What the format is good for, for lists shown to users.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Obj => "OBJ mesh per frame, read by every 3D program",
            Self::Ply => "binary PLY mesh per frame with normals",
            Self::Vtu => "VTK mesh per frame with velocities and normals, for ParaView",
            Self::Png => "picture per frame",
            Self::Gltf => "animated glTF (.glb) for Blender and web viewers",
            Self::Pc2 => "Point Cache 2 for the Mesh Cache modifier of Blender and for 3ds Max",
            Self::Mdd => "MDD point cache for the Mesh Cache modifier of Blender and LightWave",
            Self::Npz => "NumPy archive of all positions",
            Self::Gif => "animated picture, 256 colours",
            Self::Apng => "animated picture, full colour",
        }
    }

    /// Whether the format has one file per frame; the others hold all frames in one file.
    #[must_use]
    pub fn is_sequence(self) -> bool {
        matches!(self, Self::Obj | Self::Ply | Self::Vtu | Self::Png)
    }

    /// Whether the format holds pictures instead of geometry.
    #[must_use]
    pub fn is_picture(self) -> bool {
        matches!(self, Self::Png | Self::Gif | Self::Apng)
    }
}

impl fmt::Display for FrameFormat {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// An unknown format name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown output format `{name}`; use one of: {}",
    FrameFormat::ALL.map(FrameFormat::name).join(", ")
)]
pub struct FrameFormatError {
    /// The name given.
    pub name: String,
}

impl FromStr for FrameFormat {
    type Err = FrameFormatError;

    /// Reads a name from [`FrameFormat::ALL`] in any case, or `glb` for [`FrameFormat::Gltf`].
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let name = text.to_ascii_lowercase();
        let known = Self::ALL.into_iter().find(|format| format.name() == name);
        known
            .or((name == "glb").then_some(Self::Gltf))
            .ok_or_else(|| FrameFormatError { name: text.to_owned() })
    }
}
