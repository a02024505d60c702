//! What can be said on the command line.

mod overlays;
mod solver;
#[cfg(feature = "viewer")]
mod viewer;

use std::{num::NonZeroUsize, path::PathBuf, str::FromStr};

use clap::{Args, Parser, Subcommand};
use cloth::{
    Precision,
    io::{FrameFormat, PICTURE_SIDE_LIMIT},
};

use crate::failure::Failure;

#[cfg(test)]
pub(crate) use overlays::Overlay;
pub(crate) use overlays::OverlayArguments;
pub(crate) use solver::SolverArguments;
#[cfg(feature = "viewer")]
pub(crate) use viewer::{RenderArguments, ViewArguments};

/// What the help says at its end.
const AFTER_HELP: &str = "\
Start with `cloth run drape`, then look into out/drape. `cloth scenes show drape > mine.toml` gives you a scene file to change.

Exit codes:
  0    done
  1    anything that has no code of its own
  2    wrong arguments
  3    input that cannot be used: scene, mesh, checkpoint, folder, memory
  4    the simulation diverged
  5    `cloth audit` found triangles that intersect
  129  ended by SIGHUP, 130 by SIGINT (Ctrl-C), 143 by SIGTERM; a run writes its checkpoint first

Environment:
  CLOTH_CACHE_DIR   folder for compiled CUDA kernels; else $XDG_CACHE_HOME/cloth or ~/.cache/cloth
  LD_LIBRARY_PATH   where else NVRTC, the compiler for CUDA kernels, is looked for
  VK_DRIVER_FILES   Vulkan drivers to use in place of those that the system lists
  NO_COLOR          leaves colours out of help and errors
  RUST_BACKTRACE    1 adds to the message of a fault of the program where it was found";

/// Simulates cloth.
#[derive(Debug, Parser)]
#[command(name = "cloth", version, after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Print errors alone, and no progress, notes or summary.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Print a line for each frame and each file, and what drivers have to say.
    #[arg(short, long, global = true)]
    pub(crate) verbose: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scene and write its frames.
    Run(RunArguments),
    /// List the built-in scenes, or show one.
    Scenes(ScenesArguments),
    /// List the fabrics that were measured, compare some, or show one with its source.
    Fabrics(FabricsArguments),
    /// Run the tests of a textile laboratory, and compare what is measured with the numbers of the fabric and with theory.
    #[cfg(feature = "cpu")]
    Validate(ValidateArguments),
    /// Run the tests of a textile laboratory: not in this build, the Cargo feature `cpu` adds it.
    #[cfg(not(feature = "cpu"))]
    Validate(AbsentArguments),
    /// List what can compute on this machine.
    Backends,
    /// Check a scene without running it: size, memory, stability.
    Check(CheckArguments),
    /// Count triangles that intersect, exactly, in the frames of a run or in a mesh. Exit code 5 if any do.
    Audit(AuditArguments),
    /// Turn a mesh, the frames of a run, or a scene into another format.
    Convert(ConvertArguments),
    /// Show a scene, or the frames of a run, in a window.
    #[cfg(feature = "viewer")]
    View(ViewArguments),
    /// Draw a scene, or the frames of a run, through the GPU into a clip.
    #[cfg(feature = "viewer")]
    Render(RenderArguments),
    /// Show a scene in a window: not in this build, the Cargo feature `viewer` adds it.
    #[cfg(not(feature = "viewer"))]
    View(AbsentArguments),
    /// Draw a scene into a clip: not in this build, the Cargo feature `viewer` adds it.
    #[cfg(not(feature = "viewer"))]
    Render(AbsentArguments),
    /// Print a script that lets a shell complete the commands and options of this program.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page of this program, or of one of its commands, for `man`.
    Man {
        /// The command, such as run.
        command: Option<String>,
    },
}

/// Arguments of a command that this build lacks.
#[cfg(not(all(feature = "viewer", feature = "cpu")))]
#[derive(Debug, Args)]
pub(crate) struct AbsentArguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub(crate) _rest: Vec<std::ffi::OsString>,
}

#[derive(Debug, Args)]
pub(crate) struct SceneArguments {
    /// Name of a built-in scene (see `cloth scenes`) or path of a TOML file.
    pub(crate) scene: String,
    /// Further folder in which meshes of the scene may lie; can be given several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) mesh_root: Vec<PathBuf>,
    /// Precision of the arithmetic, f32 or f64, in place of the scene's.
    #[arg(long)]
    pub(crate) precision: Option<Precision>,
    /// Number of frames, in place of the scene's.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) frames: Option<u32>,
    #[command(flatten)]
    pub(crate) solver: SolverArguments,
}

#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// What computes, see `cloth backends`; `auto` takes the fastest one that can run the scene, and says
    /// which.
    #[arg(long, default_value = "cpu")]
    pub(crate) backend: String,
    /// GPU that computes, by its number or a part of its name, see `cloth backends`.
    #[arg(long, value_name = "N|NAME")]
    pub(crate) adapter: Option<String>,
    /// Threads of the CPU backend, at most 1024; as many as the machine has if not given.
    #[arg(long, value_parser = thread_count)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Output folder; out/NAME of the scene if not given, or out/NAME-2 and so on where that has a run.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Replace the run in the output folder; files that no run wrote are left alone.
    #[arg(long, conflicts_with = "resume")]
    pub(crate) overwrite: bool,
    /// Output formats, separated by commas: obj, ply, vtu, png (one file per frame), gltf, pc2,
    /// mdd, npz, gif, apng (all frames in one file); or none, for the frame store alone, from
    /// which `cloth convert` makes the others. png,gif if not given; with --resume those of the run,
    /// to which this adds.
    #[arg(long, value_name = "LIST")]
    pub(crate) format: Option<FormatList>,
    /// Show more than the cloth in obj, vtu and gltf: `colliders`, rigid bodies among them.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) with: Vec<Extra>,
    /// Write every so many frames into the output formats; 1 if not given.
    #[arg(long, value_name = "N")]
    pub(crate) frame_stride: Option<NonZeroUsize>,
    /// Size of pictures in pixels, 800x450 if not given; animated ones are scaled down to 800 pixels at most.
    #[arg(long, value_name = "WxH")]
    pub(crate) picture_size: Option<PictureSize>,
    #[command(flatten)]
    pub(crate) overlays: OverlayArguments,
    /// Draw pictures through the GPU where there is one, in the look of `cloth view`.
    #[arg(long)]
    pub(crate) render: bool,
    /// Print the report of each frame to stdout as a line of JSON, and nothing else. Then `wgpu` takes the time of every stage, too, which costs it
    /// some speed.
    #[arg(long)]
    pub(crate) json: bool,
    /// Count triangles that intersect in every frame, exactly, into report and summary.
    #[arg(long)]
    pub(crate) audit: bool,
    /// Write the contacts between triangles at the end of each frame into the folder `contacts`, as `vtu` for ParaView or `npz` for NumPy.
    #[arg(long, value_name = "FORMAT", value_enum)]
    pub(crate) contacts: Option<ContactFormat>,
    /// Write a checkpoint every so many frames, and at the end; 0 for at the end only.
    #[arg(long, value_name = "N", default_value = "30")]
    pub(crate) checkpoint_every: u64,
    /// Continue from the checkpoint in the output folder; without --out, in the latest one of this scene.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Continue although the scene changed since the run began: its cloths and colliders must be the same.
    #[arg(long, requires = "resume")]
    pub(crate) accept_changes: bool,
    /// Write the scene as FYSL into this file at the end, with where everything was in each frame.
    #[arg(long, value_name = "FILE", conflicts_with = "resume")]
    pub(crate) feedback: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct ScenesArguments {
    /// Print the list as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the JSON schema of scene files in TOML, for editors.
    #[arg(long, conflicts_with_all = ["json", "reference"])]
    pub(crate) schema: bool,
    /// Print the reference of scene files in TOML, as Markdown.
    #[arg(long, conflicts_with = "json")]
    pub(crate) reference: bool,
    /// Run all of them on the processor, and write pictures and a page `index.html` of what they show into this
    /// folder, which must be new or empty. It takes some minutes, most of them for the scenes of fabric.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["json", "schema", "reference"])]
    pub(crate) gallery: Option<PathBuf>,
    /// Take this scene alone into the gallery; can be given several times.
    #[arg(long, value_name = "NAME", requires = "gallery")]
    pub(crate) scene: Vec<String>,
    #[command(subcommand)]
    pub(crate) command: Option<ScenesCommand>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ScenesCommand {
    /// Print the text of a built-in scene, with its comments.
    Show {
        /// Name of the scene.
        name: String,
    },
}

/// What a laboratory sheet looks like.
const SHEET_HELP: &str = "\
A laboratory sheet has the names and units of the instruments; all but W and one rigidity can be left out:

  W = 16.3      # weight [mg/cm^2]
  T = 0.41      # thickness [mm]
  G = 0.8       # shear stiffness [gf/(cm degree)]
  2HG = 1.2     # hysteresis in shear [gf/cm]
  coupling = 0  # biaxial coupling [N/m]
  [warp]        # and the same for [weft]
  LT = 0.62     # linearity
  WT = 9.5      # tensile work [gf cm/cm^2]
  EMT = 6.1     # strain at 500 gf/cm [%]
  RT = 65       # tensile resilience [%]
  B = 0.09      # bending rigidity [gf cm^2/cm]
  2HB = 0.04    # hysteresis in bending [gf cm/cm]
  [bias]        # strips cut at 45 degrees
  B = 0.08

In place of B: overhang = 42 [mm], the length that hangs down by 41.5 degrees (ASTM D1388, option A). In place of LT: curve = \"warp.csv\",
lines of strain and force per width [N/m] that stretches the strip at a kept width.";

#[derive(Debug, Args)]
#[command(after_help = SHEET_HELP)]
pub(crate) struct FabricsArguments {
    /// Names of fabrics: one to see all that is known of it, several to compare them.
    pub(crate) names: Vec<String>,
    /// A laboratory sheet (TOML), fitted and shown beside them; can be given several times.
    #[arg(long, value_name = "FILE")]
    pub(crate) sheet: Vec<PathBuf>,
    /// Print JSON, all numbers in SI units.
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(feature = "cpu")]
#[derive(Debug, Args)]
pub(crate) struct ValidateArguments {
    /// Names of experiments, see --list; all of them if none is given, which takes some minutes.
    pub(crate) names: Vec<String>,
    /// List the experiments, and where what they expect comes from.
    #[arg(long)]
    pub(crate) list: bool,
    /// What computes, see `cloth backends`.
    #[arg(long, default_value = "cpu")]
    pub(crate) backend: String,
    /// GPU that computes, by its number or a part of its name, see `cloth backends`.
    #[arg(long, value_name = "N|NAME")]
    pub(crate) adapter: Option<String>,
    /// Precision of the arithmetic, f32 or f64; f64 where the backend has it if not given.
    #[arg(long)]
    pub(crate) precision: Option<Precision>,
    /// Few cases of each experiment, on one resolution.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Write a page with tables and plots into this file.
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Backend whose forms of kernels for this scene are named, with what rules out faster ones.
    #[arg(long)]
    pub(crate) backend: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct AuditArguments {
    /// The output folder of a run, or a mesh (obj, ply, gltf, glb).
    pub(crate) input: PathBuf,
    /// Take every so many frames of a run, and the last one.
    #[arg(long, value_name = "N")]
    pub(crate) frame_stride: Option<NonZeroUsize>,
    /// Print a line of JSON for each frame, and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// Further folder in which meshes of the scene of a run may lie; can be given several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) mesh_root: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ConvertArguments {
    /// A mesh (obj, ply, gltf, glb), the output folder of a run, or a scene (toml, fysl).
    pub(crate) input: PathBuf,
    /// The file to write; a folder for formats with one file per frame. Its extension says the
    /// format, unless --format does. Folders that are missing are made.
    pub(crate) output: PathBuf,
    /// Format of the output, by the names of `cloth run --format`.
    #[arg(long)]
    pub(crate) format: Option<FrameFormat>,
    /// Show more than the cloth in obj, vtu and gltf: `colliders`, rigid bodies among them.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) with: Vec<Extra>,
    /// Take every so many frames of a run.
    #[arg(long, value_name = "N")]
    pub(crate) frame_stride: Option<NonZeroUsize>,
    /// Size of pictures in pixels.
    #[arg(long, value_name = "WxH", default_value = "800x450")]
    pub(crate) picture_size: PictureSize,
    #[command(flatten)]
    pub(crate) overlays: OverlayArguments,
    /// Further folder in which meshes of the scene of a run may lie; can be given several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) mesh_root: Vec<PathBuf>,
}

/// Most threads that can be asked for. Far more than that is a slip, and systems answer it by ending
/// the program.
const THREAD_LIMIT: usize = 1024;

fn thread_count(text: &str) -> Result<NonZeroUsize, String> {
    let count = text.parse().ok().filter(|count: &NonZeroUsize| count.get() <= THREAD_LIMIT);
    count.ok_or_else(|| format!("give a number of threads from 1 to {THREAD_LIMIT}"))
}

/// What formats of frames can show beside the cloth.
/// A format of files of contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ContactFormat {
    /// VTK XML, a point for each contact.
    Vtu,
    /// NumPy archive.
    Npz,
}

impl ContactFormat {
    /// The extension of its files.
    pub(crate) const fn extension(self) -> &'static str {
        match self {
            Self::Vtu => "vtu",
            Self::Npz => "npz",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Extra {
    /// Colliders and rigid bodies.
    Colliders,
}

impl Extra {
    /// Whether colliders are asked for; an error if none of `formats` has a place for them.
    pub(crate) fn colliders(wanted: &[Self], formats: &[FrameFormat]) -> Result<bool, Failure> {
        let holds =
            |f: &FrameFormat| matches!(f, FrameFormat::Obj | FrameFormat::Vtu | FrameFormat::Gltf);
        if !wanted.is_empty() && !formats.iter().any(holds) {
            let problem = "--with colliders belongs to the formats obj, vtu and gltf; use one of \
                           them or leave it out";
            return Err(Failure::Usage(problem.to_owned()));
        }
        Ok(wanted.contains(&Self::Colliders))
    }
}

/// Output formats of a run, each once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FormatList(pub(crate) Vec<FrameFormat>);

impl Default for FormatList {
    fn default() -> Self {
        Self(vec![FrameFormat::Png, FrameFormat::Gif])
    }
}

impl FromStr for FormatList {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("none") {
            return Ok(Self(Vec::new()));
        }
        let mut formats = Vec::new();
        for name in text.split(',') {
            let format = FrameFormat::from_str(name.trim()).map_err(|error| error.to_string())?;
            if !formats.contains(&format) {
                formats.push(format);
            }
        }
        Ok(Self(formats))
    }
}

/// Width and height of a picture \[pixel\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureSize {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Default for PictureSize {
    fn default() -> Self {
        Self { width: 800, height: 450 }
    }
}

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|s| (1..=PICTURE_SIDE_LIMIT).contains(s));
        text.split_once(['x', 'X'])
            .and_then(|(width, height)| Some(Self { width: side(width)?, height: side(height)? }))
            .ok_or_else(|| {
                format!("write it as 800x450, with sides of 1 to {PICTURE_SIDE_LIMIT} pixels")
            })
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn the_help_names_every_format() {
        let command = Arguments::command();
        let run = command.find_subcommand("run").unwrap();
        let format = run.get_arguments().find(|argument| argument.get_id() == "format").unwrap();
        let help = format.get_help().unwrap().to_string();
        for format in FrameFormat::ALL {
            assert!(help.contains(format.name()), "{format}");
        }
    }

    #[test]
    fn formats_are_taken_once_and_unknown_ones_are_refused() {
        let list: FormatList = "png, GIF,png".parse().unwrap();
        assert_eq!(list.0, [FrameFormat::Png, FrameFormat::Gif]);
        assert_eq!("none".parse(), Ok(FormatList(vec![])));
        assert!("png,".parse::<FormatList>().is_err());
    }

    #[test]
    fn numbers_of_threads_have_a_limit() {
        assert_eq!(thread_count("1024").map(NonZeroUsize::get), Ok(1024));
        for wrong in ["0", "1025", "100000", "18446744073709551616", "-1", "two"] {
            let message = thread_count(wrong).unwrap_err();
            assert!(message.contains("from 1 to 1024"), "{wrong}: {message}");
        }
    }

    #[test]
    fn sizes_of_pictures_are_positive() {
        assert_eq!("64x36".parse(), Ok(PictureSize { width: 64, height: 36 }));
        for wrong in ["64", "64x", "0x9", "9x0", "-1x5", "99999x9", "64x36x2"] {
            assert!(wrong.parse::<PictureSize>().is_err(), "{wrong}");
        }
    }
}
