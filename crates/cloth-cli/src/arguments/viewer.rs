//! What can be said about windows and clips.

use std::{num::NonZeroU64, path::PathBuf};

use clap::Args;
use cloth::StrainMeasure;
use cloth_viewer::Overlays;

use super::{PictureSize, SolverArguments, overlays::strain_scale};

#[derive(Debug, Args)]
pub(crate) struct ViewArguments {
    /// Name of a built-in scene (see `cloth scenes`), path of a TOML file, the output folder of
    /// `cloth run`, or frames as .obj, .ply, .pc2 or .mdd.
    #[arg(default_value = "drape")]
    pub(crate) scene: String,
    #[command(flatten)]
    pub(crate) source: SourceArguments,
    /// Begin paused.
    #[arg(long)]
    pub(crate) paused: bool,
    /// Size of the window in points.
    #[arg(long, value_name = "WxH", default_value = "1280x800")]
    pub(crate) window_size: PictureSize,
    /// Folder for screenshots and recordings.
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub(crate) out: PathBuf,
    /// Memory for frames that can be gone back to, in MiB: the oldest make room for new ones.
    #[arg(long, value_name = "MIB", default_value = "512")]
    pub(crate) keep: u32,
    /// Write a line of JSON about every frame that is shown into this file, for scripts that drive
    /// the window.
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct RenderArguments {
    /// Name of a built-in scene (see `cloth scenes`), path of a TOML file, the output folder of
    /// `cloth run`, or frames as .obj, .ply, .pc2 or .mdd.
    pub(crate) scene: String,
    #[command(flatten)]
    pub(crate) source: SourceArguments,
    /// The file to write; its extension says the format: mp4 (AV1), gif, or png for an
    /// animated PNG.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Number of frames, in place of the scene's.
    #[arg(long)]
    pub(crate) frames: Option<u64>,
    /// Draw every so many frames.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) frame_stride: NonZeroU64,
    /// Draw the last frame alone, as a PNG.
    #[arg(long)]
    pub(crate) still: bool,
    /// Size of the pictures in pixels.
    #[arg(long, value_name = "WxH", default_value = "800x450")]
    pub(crate) picture_size: PictureSize,
    /// What to draw beside the surface, separated by commas: wires, stretch, shear, bend (springs),
    /// strain (stretch), strain-warp, strain-weft, strain-shear (components of Green strain), threads (lines along warp and weft of fabric), pins, contacts, bins; or none. What the scene says if not given.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) overlay: Vec<Overlay>,
    /// Strain that is red with `--overlay strain` and its like; 0.1 if not given.
    #[arg(long, value_name = "SHARE", requires = "overlay", value_parser = strain_scale)]
    pub(crate) strain_scale: Option<f64>,
}

#[derive(Debug, Args)]
pub(crate) struct SourceArguments {
    /// What computes, see `cloth backends`; `auto` takes the GPU that draws if it is one and
    /// can run the scene, else the CPU.
    #[arg(long, default_value = "auto")]
    pub(crate) backend: String,
    /// GPU that draws, by its number or a part of its name, see `cloth backends`.
    #[arg(long, value_name = "N|NAME")]
    pub(crate) adapter: Option<String>,
    #[command(flatten)]
    pub(crate) solver: SolverArguments,
}

/// Something that is drawn beside the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Overlay {
    Wires,
    Stretch,
    Shear,
    Bend,
    Strain,
    StrainWarp,
    StrainWeft,
    StrainShear,
    Threads,
    Pins,
    Contacts,
    Bins,
    None,
}

impl Overlay {
    /// The strain that it shows.
    const fn measure(self) -> Option<StrainMeasure> {
        match self {
            Self::Strain => Some(StrainMeasure::Stretch),
            Self::StrainWarp => Some(StrainMeasure::Warp),
            Self::StrainWeft => Some(StrainMeasure::Weft),
            Self::StrainShear => Some(StrainMeasure::Shear),
            _ => None,
        }
    }
}

impl RenderArguments {
    /// What to draw, unless that is left to the scene.
    pub(crate) fn overlays(&self) -> Option<Overlays> {
        if self.overlay.is_empty() {
            return None;
        }
        let has = |overlay| self.overlay.contains(&overlay);
        let standard = Overlays::default();
        let measure = self.overlay.iter().find_map(|overlay| overlay.measure());
        Some(Overlays {
            wires: has(Overlay::Wires),
            springs: [has(Overlay::Stretch), has(Overlay::Shear), has(Overlay::Bend)],
            strain: measure.is_some(),
            strain_measure: measure.unwrap_or_default(),
            strain_scale: self.strain_scale.unwrap_or(standard.strain_scale),
            threads: has(Overlay::Threads),
            pins: has(Overlay::Pins),
            contacts: has(Overlay::Contacts),
            bins: has(Overlay::Bins),
            ..standard
        })
    }
}
