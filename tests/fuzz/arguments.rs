//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Searches inputs that make the program panic, hang or take too much memory.
#[derive(Parser)]
#[command(name = "cloth-fuzz", args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) task: Option<Task>,
    #[command(flatten)]
    pub(crate) campaign: CampaignArguments,
}

#[derive(Subcommand)]
pub(crate) enum Task {
    /// Reads inputs that were kept, each in the target that its folder is named after.
    Replay(ReplayArguments),
    /// Kills runs at random moments, resumes them, and compares them with runs that were left alone.
    Kills(KillArguments),
    /// Reads the inputs that the parent process asks for.
    #[command(hide = true)]
    Worker {
        /// Memory that it may take \[MiB\].
        #[arg(long)]
        memory: u64,
    },
}

/// Which inputs, and for how long.
#[derive(Args)]
pub(crate) struct CampaignArguments {
    /// How long new inputs are tried \[s\].
    #[arg(long, default_value_t = 60)]
    pub(crate) seconds: u64,
    /// Inputs after which it ends, whatever time is left.
    #[arg(long)]
    pub(crate) inputs: Option<u64>,
    /// What the inputs follow from; the same seed gives the same ones.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Only this target; can be given several times.
    #[arg(long = "target")]
    pub(crate) targets: Vec<String>,
    /// Processes side by side.
    #[arg(long, default_value_t = 1)]
    pub(crate) jobs: usize,
    /// Where findings are kept, in a folder for each target.
    #[arg(long, default_value = "fuzz-findings")]
    pub(crate) regressions: PathBuf,
    #[command(flatten)]
    pub(crate) limits: Limits,
}

/// What an input may take.
#[derive(Args, Clone, Copy)]
pub(crate) struct Limits {
    /// Time for one input \[s\].
    #[arg(long, default_value_t = 20)]
    pub(crate) deadline: u64,
    /// Memory for one input \[MiB\].
    #[arg(long, default_value_t = 768)]
    pub(crate) memory: u64,
}

#[derive(Args)]
pub(crate) struct ReplayArguments {
    /// Files, or folders of them.
    #[arg(required = true)]
    pub(crate) paths: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) limits: Limits,
}

#[derive(Args)]
pub(crate) struct KillArguments {
    /// The program `cloth`.
    #[arg(long)]
    pub(crate) program: PathBuf,
    /// Runs that are killed.
    #[arg(long, default_value_t = 20)]
    pub(crate) kills: u64,
    /// What moments and signals follow from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Runs side by side.
    #[arg(long, default_value_t = 1)]
    pub(crate) jobs: usize,
    /// Only this built-in scene; can be given several times.
    #[arg(long = "scene")]
    pub(crate) scenes: Vec<String>,
    /// Only this backend; can be given several times. All that the machine has if left out.
    #[arg(long = "backend")]
    pub(crate) backends: Vec<String>,
    /// Frames of a run.
    #[arg(long, default_value_t = 12)]
    pub(crate) frames: u64,
    /// Particles along a side of a patch at most, so that runs are short. Whole scenes if left out.
    #[arg(long)]
    pub(crate) side: Option<u32>,
}
