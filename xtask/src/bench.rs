//! `cargo xtask bench`.

use std::path::PathBuf;

use clap::Args;

use crate::command;

/// What `cloth-bench` and criterion are told.
#[derive(Args)]
pub(crate) struct BenchArguments {
    /// Backends to measure, separated by commas: cpu, wgpu, cuda.
    #[arg(long)]
    backends: Option<String>,
    /// What to run: quick, full or tables.
    #[arg(long, default_value = "quick")]
    suite: String,
    /// Folder for results.json, results.csv and index.html.
    #[arg(long, default_value = "target/bench")]
    out: PathBuf,
    /// Results of an earlier run to compare with.
    #[arg(long, value_name = "RESULTS.json")]
    compare: Option<PathBuf>,
    /// Write the table of the README from these results.json, one for each machine, in place of measuring.
    #[arg(long, value_name = "RESULTS.json", num_args = 1..)]
    readme: Vec<PathBuf>,
}

/// Runs the program `cloth-bench`, and then the groups of criterion; whether they succeeded.
pub(crate) fn run(arguments: &BenchArguments) -> bool {
    let outcome = if arguments.readme.is_empty() { measure(arguments) } else { readme(arguments) };
    match outcome {
        Ok(()) => true,
        Err(reason) => {
            eprintln!("bench: {reason}");
            false
        }
    }
}

fn program() -> std::process::Command {
    let run = ["run", "--release", "--package", "cloth-benches", "--bin", "cloth-bench", "--"];
    let mut program = command::cargo(&run);
    if let Some(revision) = command::revision() {
        program.env("CLOTH_REVISION", revision);
    }
    program
}

fn readme(arguments: &BenchArguments) -> Result<(), String> {
    command::run(program().arg("readme").args(&arguments.readme))
}

fn measure(arguments: &BenchArguments) -> Result<(), String> {
    let BenchArguments { backends, suite, out, compare, .. } = arguments;
    // It checks what it is told before anything is measured.
    let mut bench = program();
    bench.args(["--suite", suite]).arg("--out").arg(out);
    if let Some(backends) = backends {
        bench.args(["--backends", backends]);
    }
    if let Some(compare) = compare {
        bench.arg("--compare").arg(compare);
    }
    command::run(&mut bench)?;
    if suite == "tables" {
        return Ok(());
    }
    let groups =
        ["bench", "--package", "cloth-benches", "--bench", "explicit", "--bench", "implicit"];
    let mut criterion = command::cargo(&groups);
    if suite == "quick" {
        criterion.args(["--", "--quick"]);
    }
    if let Some(backends) = backends {
        criterion.env("CLOTH_BACKENDS", backends);
    }
    command::run(&mut criterion)?;
    println!("criterion: target/criterion/report/index.html");
    Ok(())
}
