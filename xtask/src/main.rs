//! Tasks of the repository: `cargo xtask test`, `cargo xtask fuzz`, `cargo xtask kills`, `cargo xtask kernels`, `cargo xtask bench`,
//! `cargo xtask dist`, `cargo xtask package`, `cargo xtask ci`.

mod artifacts;
mod bench;
mod command;
mod compiler;
mod dist;
mod fuzz;
mod kernels;
mod package;
mod packages;
mod passed;
mod programs;
#[cfg(test)]
mod recipe;
mod screen;
mod summary;
mod test;
mod vulkan;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Tasks of the repository.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Run every check that a change must pass: format, lints, documentation, tests, a smoke run.
    Test(test::TestArguments),
    /// Search inputs that make the program panic, hang or take too much memory; findings are kept in `tests/fuzz/regressions`.
    Fuzz(fuzz::FuzzArguments),
    /// Kill runs of all scenes on all backends at random moments, resume them, and compare them with runs that were left alone.
    Kills(fuzz::KillsArguments),
    /// Check that every GPU kernel, with every set of its options, is valid. Needs no GPU.
    Kernels,
    /// Measure every backend of this machine, check its results, and write one page about it.
    Bench(bench::BenchArguments),
    /// Gather prebuilt tests, benchmark and program for a GPU machine without Rust, with a script that runs them.
    Dist,
    /// Check that every crate can be packaged, and how many crates a game takes with the facade.
    Package,
    /// What continuous integration runs: the same as `test`.
    Ci(test::TestArguments),
}

fn main() -> ExitCode {
    let success = match Arguments::parse().task {
        Task::Test(arguments) | Task::Ci(arguments) => test::run(&arguments),
        Task::Fuzz(arguments) => fuzz::run(&arguments),
        Task::Kills(arguments) => fuzz::kills(&arguments),
        Task::Kernels => kernels::run(),
        Task::Package => package::run(),
        Task::Dist => dist::run(),
        Task::Bench(arguments) => bench::run(&arguments),
    };
    if success { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
