//! `cargo xtask test`: every check, the next one even if one failed.

use std::{env, fs, process::Command, time::Instant};

use clap::Args;

use crate::{
    artifacts::{self, Artifact},
    command::{self, cargo},
    compiler,
    fuzz::Beside,
    kernels, package,
    passed::Passed,
    programs,
    programs::Counts,
    screen,
    summary::{StepOutcome, Summary},
    vulkan,
};

/// A check by name.
type Step = (&'static str, fn(&mut Built) -> Result<(), String>);

const STEPS: [Step; 13] = [
    ("format", |_| format()),
    ("vulkan driver", |_| vulkan::ensure()),
    ("virtual screen", |_| screen::ensure()),
    ("C++ compiler", |_| compiler::ensure()),
    ("package", |_| package::check()),
    ("lints", |_| lints()),
    ("features", |_| features()),
    ("documentation", |_| documentation()),
    ("build", Built::build),
    ("kernels", Built::kernels),
    ("tests", Built::tests),
    ("fuzzing", Built::fuzzed),
    ("smoke run", |built| smoke_run(built.program("bin", "cloth")?)),
];

/// What the program can have: tests are of all of it.
pub(crate) const FEATURES: &str = "cloth-cli/cuda,cloth-cli/viewer";

/// What the program is built with elsewhere, beside all of it; the features of the others are among these.
const COMBINATIONS: [&str; 5] = ["", "cpu", "reference", "wgpu", "cuda"];

#[derive(Args)]
pub(crate) struct TestArguments {
    /// How long inputs that nobody would write are tried beside the tests, in seconds.
    #[arg(long, default_value_t = 120)]
    fuzz_seconds: u64,
    /// Run what passed before, too, though nothing has changed since.
    #[arg(long)]
    again: bool,
    /// One test alone, in its long form.
    only: Option<LongTest>,
    /// Pairs of features that `certificate` judges in each precision.
    #[arg(long, default_value_t = 100_000_000, requires = "only")]
    pairs: u64,
}

/// Tests that are short beside all others and long if they are asked for.
#[derive(Clone, Copy, clap::ValueEnum)]
enum LongTest {
    /// The certificate of contact against exact arithmetic: 100 million pairs take minutes.
    Certificate,
}

/// What the checks that run something share: all is built once, as features of packages differ if they are built one by one.
#[derive(Default)]
struct Built {
    programs: Vec<Artifact>,
    counts: Counts,
    passed: Passed,
    again: bool,
    fuzz_seconds: u64,
    /// The outcome of fuzzing, once the tests are done beside which it runs.
    fuzzed: Option<Result<(), String>>,
}

/// Runs all checks and prints the summary; whether all succeeded.
pub(crate) fn run(arguments: &TestArguments) -> bool {
    if let Some(LongTest::Certificate) = arguments.only {
        return certificate(arguments.pairs);
    }
    let mut summary = Summary::default();
    let TestArguments { fuzz_seconds, again, .. } = *arguments;
    let mut built = Built { fuzz_seconds, again, ..Built::default() };
    for (name, step) in STEPS {
        println!("== {name}");
        let start = Instant::now();
        let failure = step(&mut built).err();
        summary.outcomes.push(StepOutcome { name, time: start.elapsed(), failure });
    }
    summary.counts = built.counts;
    print!("{summary}");
    summary.success()
}

/// So many pairs of each precision; whether none that meets was certified.
fn certificate(pairs: u64) -> bool {
    let arguments = ["test", "--workspace", "--features", FEATURES, "--test", "certificate"];
    let mut command = cargo(&arguments);
    command.args(["--", "--nocapture"]).env("CLOTH_CERTIFICATE_PAIRS", pairs.to_string());
    command::run(&mut command).inspect_err(|reason| eprintln!("certificate: {reason}")).is_ok()
}

fn format() -> Result<(), String> {
    command::run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn lints() -> Result<(), String> {
    let arguments = ["clippy", "--workspace", "--all-targets", "--features", FEATURES];
    command::run(cargo(&arguments).args(["--", "-D", "warnings"]))
}

/// Program and library compile with each of their features alone, and without any.
fn features() -> Result<(), String> {
    let of = |package| COMBINATIONS.map(|features| (package, features));
    ["cloth-cli", "cloth"].into_iter().flat_map(of).try_for_each(|(package, features)| {
        let arguments = ["check", "--quiet", "--package", package, "--no-default-features"];
        command::run(cargo(&arguments).args(["--features", features]))
            .map_err(|reason| format!("{package}, features \"{features}\": {reason}"))
    })
}

fn documentation() -> Result<(), String> {
    let arguments = ["doc", "--workspace", "--no-deps", "--features", FEATURES];
    command::run(cargo(&arguments).env("RUSTDOCFLAGS", "-D warnings"))
}

impl Built {
    /// Builds all tests, and with them the examples and the program.
    fn build(&mut self) -> Result<(), String> {
        self.programs =
            artifacts::build(&["test", "--workspace", "--features", FEATURES, "--no-run"])?;
        self.passed = Passed::open(&self.programs, self.again);
        Ok(())
    }

    /// A program that is no test.
    fn program(&self, kind: &str, name: &str) -> Result<&Artifact, String> {
        let is_it = |artifact: &&Artifact| {
            !artifact.is_test && artifact.kind == kind && artifact.name == name
        };
        self.programs.iter().find(is_it).ok_or_else(|| format!("the {kind} {name} was not built"))
    }

    /// Compiles all CUDA kernels.
    fn kernels(&mut self) -> Result<(), String> {
        for name in kernels::EXAMPLES {
            let program = self.program("example", name)?;
            if self.passed.text(program).is_some() {
                println!("{name}: passed before, and nothing has changed since");
                continue;
            }
            kernels::check(&program.path, false)?;
            self.passed.note(program, "");
        }
        Ok(())
    }

    /// Unit tests, the test package, and the examples in the documentation.
    fn tests(&mut self) -> Result<(), String> {
        let tests = self.programs.iter().filter(|program| program.is_test).cloned().collect();
        let fuzz = self.program("bin", "cloth-fuzz").cloned();
        let is_old = fuzz.as_ref().is_ok_and(|program| self.passed.text(program).is_some());
        let seconds = if is_old { 0 } else { self.fuzz_seconds };
        let beside = fuzz.as_ref().map_err(Clone::clone);
        let beside = beside.and_then(|program| Beside::start(&program.path, seconds));
        let (ran, fuzzed) = programs::run(tests, &mut self.counts, &self.passed, || {
            beside.and_then(Beside::finish)
        });
        if let (Ok(program), Ok(())) = (&fuzz, &fuzzed) {
            self.passed.note(program, "");
        }
        self.fuzzed = Some(fuzzed);
        let documented = programs::documented(&mut self.counts);
        ran.and(documented)
    }

    /// What became of the fuzzing beside the tests.
    fn fuzzed(&mut self) -> Result<(), String> {
        self.fuzzed.take().unwrap_or_else(|| Err("the tests were not run".into()))
    }
}

/// The program simulates a scene and leaves frames behind.
fn smoke_run(program: &Artifact) -> Result<(), String> {
    let folder = env::temp_dir().join(format!("cloth-smoke-{}", std::process::id()));
    let mut command = Command::new(&program.path);
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
