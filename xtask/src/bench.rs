//! `cargo xtask bench`.

use std::path::PathBuf;

use clap::Args;

use crate::{command, packages};

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
    /// Measure beside the plain programs of benches/reference alone, which are built first.
    #[arg(long)]
    reference: bool,
}

/// Runs the program `cloth-bench`, and then the groups of criterion; whether they succeeded.
pub(crate) fn run(arguments: &BenchArguments) -> bool {
    let outcome = match arguments {
        BenchArguments { reference: true, .. } => reference(),
        BenchArguments { readme, .. } if !readme.is_empty() => self::readme(arguments),
        _ => measure(arguments),
    };
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

/// Ours beside the reference programs: those in C++, and the one in CUDA where there is its compiler.
fn reference() -> Result<(), String> {
    let bench =
        |name: &str| command::cargo(&["bench", "--package", "cloth-benches", "--bench", name]);
    command::run(&mut bench("workload"))?;
    command::run(bench("integrators").args(["--", "paired"]))?;
    if !packages::has_program("nvcc") {
        println!("the reference program in CUDA was not run: there is no nvcc");
        return Ok(());
    }
    let program = std::env::temp_dir().join(format!("cloth-reference-{}", std::process::id()));
    let mut compile = std::process::Command::new("nvcc");
    compile.args(["-std=c++17", "-O3", "-arch=native", "-o"]).arg(&program);
    let source = command::root().join("benches/reference/explicit.cu");
    let ran = command::run(compile.arg(source)).and_then(|()| {
        let sides = ["--", "--sides", "160,1024", "--reference"];
        command::run(bench("cuda").args(sides).arg(&program))
    });
    // It is not there if it did not compile.
    let _ = std::fs::remove_file(&program);
    ran
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
