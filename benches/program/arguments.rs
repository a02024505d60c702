//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};

/// Measures every backend that this machine has, checks its results, and writes one page about it.
#[derive(Parser)]
#[command(name = "cloth-bench", version)]
pub(crate) struct Arguments {
    /// Backends to measure, separated by commas; those that this machine lacks are listed as absent.
    #[arg(long, value_delimiter = ',', default_values = ["cpu", "wgpu", "cuda"])]
    pub(crate) backends: Vec<BackendName>,
    /// What to run: a few minutes, everything, the published tables alone, or solvers of linear systems by themselves.
    #[arg(long, value_enum, default_value_t = Suite::Quick)]
    pub(crate) suite: Suite,
    /// Folder for results.json, results.csv and index.html.
    #[arg(long, default_value = "target/bench")]
    pub(crate) out: PathBuf,
    /// Results of an earlier run to compare with: ratios of the times, with bounds of their noise.
    #[arg(long, value_name = "RESULTS.json")]
    pub(crate) compare: Option<PathBuf>,
    /// Number or part of the name of the GPU for wgpu.
    #[arg(long)]
    pub(crate) adapter: Option<String>,
    #[command(subcommand)]
    pub(crate) task: Option<Task>,
}

/// What else there is to do.
#[derive(Subcommand)]
pub(crate) enum Task {
    /// Write the table and the plot of some results into a README, between its marks.
    Readme {
        /// Files results.json, one for each machine.
        #[arg(required = true)]
        results: Vec<PathBuf>,
        /// The file with the marks `<!-- benchmark:begin -->` and `<!-- benchmark:end -->`.
        #[arg(long, default_value = "README.md")]
        into: PathBuf,
        /// Where to write the plot, as an SVG picture.
        #[arg(long, default_value = "benches/results/frame_time.svg")]
        plot: PathBuf,
    },
}

/// A backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BackendName {
    Cpu,
    Wgpu,
    Cuda,
}

impl BackendName {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Cpu => "cpu",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        }
    }
}

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Suite {
    /// Small sizes, few frames.
    Quick,
    /// All sizes, all frames, and the tables.
    Full,
    /// The published tables alone.
    Tables,
    /// Solvers of linear systems: iterations and time against particles, stiffness, time step and layers in contact.
    Linear,
}

impl Suite {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Full => "full",
            Self::Tables => "tables",
            Self::Linear => "linear",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unknown_is_refused_with_what_there_is() {
        for (flag, value, known) in
            [("--backends", "cpu,metal", "wgpu"), ("--suite", "huge", "tables")]
        {
            let error =
                Arguments::try_parse_from(["cloth-bench", flag, value]).err().unwrap().to_string();
            assert!(error.contains(known), "{error}");
        }
        let arguments =
            Arguments::try_parse_from(["cloth-bench", "--backends", "cuda,cpu"]).unwrap();
        assert_eq!(arguments.backends, [BackendName::Cuda, BackendName::Cpu]);
    }
}
