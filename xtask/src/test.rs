//! `cargo xtask test`: every check, the next one even if one failed.

use std::{env, fs, process::Command, time::Instant};

use crate::{
    command::{self, cargo},
    compiler, kernels, screen,
    summary::{StepOutcome, Summary},
    vulkan,
};

/// A check by name.
type Step = (&'static str, fn() -> Result<(), String>);

const STEPS: [Step; 9] = [
    ("format", format),
    ("kernels", kernels::check),
    ("vulkan driver", vulkan::ensure),
    ("virtual screen", screen::ensure),
    ("C++ compiler", compiler::ensure),
    ("lints", lints),
    ("documentation", documentation),
    ("tests", tests),
    ("smoke run", smoke_run),
];

/// Runs all checks and prints the summary; whether all succeeded.
pub(crate) fn run() -> bool {
    let mut summary = Summary::default();
    for (name, step) in STEPS {
        println!("== {name}");
        let start = Instant::now();
        let failure = step().err();
        summary.outcomes.push(StepOutcome { name, time: start.elapsed(), failure });
    }
    print!("{summary}");
    summary.success()
}

fn format() -> Result<(), String> {
    command::run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn lints() -> Result<(), String> {
    command::run(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))
}

fn documentation() -> Result<(), String> {
    command::run(cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Unit tests, the test package, and the examples in the documentation.
fn tests() -> Result<(), String> {
    command::run(&mut cargo(&["test", "--workspace", "--no-fail-fast"]))
}

/// The program, as the tests have built it, simulates a scene and leaves frames behind.
fn smoke_run() -> Result<(), String> {
    let folder = env::temp_dir().join(format!("cloth-smoke-{}", std::process::id()));
    // Beside this program. Cargo itself would build it once more, as it has other features when it is built alone.
    let name = format!("cloth{}", env::consts::EXE_SUFFIX);
    let program = env::current_exe().map_err(|error| error.to_string())?.with_file_name(name);
    let mut command = Command::new(program);
    let ran = command::run(command.args(["run", "drape", "--frames", "2", "--out"]).arg(&folder));
    let files = fs::read_dir(&folder).map_or(0, Iterator::count);
    // The folder may not exist if the run failed; that failure is the one to report.
    let _ = fs::remove_dir_all(&folder);
    ran?;
    if files == 0 { Err("the run left no frame behind".into()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    /// Cargo asks which program is meant if several packages have one and not exactly one says that it is the default.
    #[test]
    fn cargo_run_means_the_program_cloth() {
        let mut metadata = cargo(&["metadata", "--no-deps", "--offline", "--format-version", "1"]);
        let output = metadata.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let workspace: Value = serde_json::from_slice(&output.stdout).unwrap();
        let defaults = workspace["workspace_default_members"].as_array().unwrap();
        let packages = workspace["packages"].as_array().unwrap();
        let packages = packages.iter().filter(|package| defaults.contains(&package["id"]));
        let is_program = |target: &Value| target["kind"][0] == "bin" && target["name"] == "cloth";
        let programs: Vec<_> =
            packages.filter(|package| package["default_run"].is_string()).collect();
        let [package] = programs[..] else { panic!("{programs:#?}") };
        assert_eq!(package["default_run"], "cloth");
        assert!(package["targets"].as_array().unwrap().iter().any(is_program));
    }
}
