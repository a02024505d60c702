//! `cargo xtask fuzz` and `cargo xtask kills`: the program `cloth-fuzz` of the tests, with findings kept where tests read them again.

use std::{
    path::Path,
    process::{Child, Command, Stdio},
};

use clap::Args;

use crate::{
    artifacts::{self, Artifact},
    command,
    test::FEATURES,
};

/// Where inputs are kept that did harm, below the root.
const REGRESSIONS: &str = "tests/fuzz/regressions";

#[derive(Args)]
pub(crate) struct FuzzArguments {
    /// How long new inputs are tried, in seconds.
    #[arg(long, default_value_t = 60)]
    pub(crate) seconds: u64,
    /// What the inputs follow from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Only this target; can be given several times.
    #[arg(long = "target")]
    pub(crate) targets: Vec<String>,
    /// Processes side by side.
    #[arg(long, default_value_t = 1)]
    pub(crate) jobs: usize,
}

#[derive(Args)]
pub(crate) struct KillsArguments {
    /// Runs that are killed.
    #[arg(long, default_value_t = 1000)]
    pub(crate) count: u64,
    /// What moments and signals follow from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Runs side by side.
    #[arg(long, default_value_t = 1)]
    pub(crate) jobs: usize,
    /// Particles along a side of a patch at most: scenes are cut down to it. 0 leaves them whole.
    #[arg(long, default_value_t = 10)]
    pub(crate) side: u32,
}

/// Builds the program and tries inputs; whether nothing was found.
pub(crate) fn run(arguments: &FuzzArguments) -> bool {
    let outcome = built(["cloth-fuzz"])
        .and_then(|[program]| command::run(&mut of(&program.path, arguments)))
        .inspect_err(|reason| eprintln!("fuzz: {reason}"));
    outcome.is_ok()
}

/// Builds the program and kills runs; whether nothing was lost.
pub(crate) fn kills(arguments: &KillsArguments) -> bool {
    let KillsArguments { count, seed, jobs, side } = arguments;
    let killed = |[fuzz, cloth]: [Artifact; 2]| {
        let mut command = Command::new(&fuzz.path);
        command.current_dir(command::root()).arg("kills").arg("--program").arg(&cloth.path);
        for (option, value) in [("--kills", *count), ("--seed", *seed), ("--jobs", *jobs as u64)] {
            command.args([option, &value.to_string()]);
        }
        if *side > 0 {
            command.args(["--side", &side.to_string()]);
        }
        command::run(&mut command)
    };
    let outcome = built(["cloth-fuzz", "cloth"]).and_then(killed);
    outcome.inspect_err(|reason| eprintln!("kills: {reason}")).is_ok()
}

/// Programs of the workspace, as tests have them.
fn built<const N: usize>(names: [&str; N]) -> Result<[Artifact; N], String> {
    let mut build = vec!["build", "--workspace", "--features", FEATURES];
    build.extend(names.iter().flat_map(|name| ["--bin", name]));
    let programs = artifacts::build(&build)?;
    let found = names.map(|name| {
        let program = programs.iter().find(|program| program.name == name && program.kind == "bin");
        program.cloned().ok_or_else(|| format!("{name} was not built"))
    });
    let found: Vec<Artifact> = found.into_iter().collect::<Result<_, _>>()?;
    found.try_into().map_err(|_| "a program was not built".to_owned())
}

/// The program with these arguments.
fn of(program: &Path, arguments: &FuzzArguments) -> Command {
    let FuzzArguments { seconds, seed, targets, jobs } = arguments;
    let mut command = Command::new(program);
    command.current_dir(command::root()).args(["--regressions", REGRESSIONS]);
    for (option, value) in [("--seconds", *seconds), ("--seed", *seed), ("--jobs", *jobs as u64)] {
        command.args([option, &value.to_string()]);
    }
    for target in targets {
        command.args(["--target", target]);
    }
    command
}

/// The same command, which lets others go first where the system has a program for that.
fn patient(command: &Command) -> Command {
    if cfg!(not(unix)) {
        let mut same = Command::new(command.get_program());
        same.args(command.get_args()).current_dir(command::root());
        return same;
    }
    let mut patient = Command::new("nice");
    patient.args(["-n", "10"]).arg(command.get_program()).args(command.get_args());
    patient.current_dir(command::root());
    patient
}

/// The program beside tests, which it hardly slows down.
pub(crate) struct Beside(Child);

impl Beside {
    /// Begins, with the seed that is always the same.
    ///
    /// # Errors
    /// Why it did not start.
    pub(crate) fn start(program: &Path, seconds: u64) -> Result<Self, String> {
        let arguments = FuzzArguments { seconds, seed: 1, targets: Vec::new(), jobs: 1 };
        let mut command = patient(&of(program, &arguments));
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().map(Self).map_err(|error| format!("{}: {error}", program.display()))
    }

    /// Waits for its end, and prints what it found.
    ///
    /// # Errors
    /// Its status, if it found something.
    pub(crate) fn finish(self) -> Result<(), String> {
        let output = self.0.wait_with_output().map_err(|error| error.to_string())?;
        for stream in [output.stdout, output.stderr] {
            print!("{}", String::from_utf8_lossy(&stream));
        }
        if output.status.success() { Ok(()) } else { Err(output.status.to_string()) }
    }
}
