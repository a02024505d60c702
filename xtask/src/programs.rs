//! Test programs: several at a time, their results counted, what they could not run listed.

use std::{
    collections::{BTreeSet, VecDeque},
    num::NonZeroUsize,
    process::{Command, Stdio},
    sync::{Mutex, PoisonError},
    thread,
    time::Instant,
};

use crate::{artifacts::Artifact, command::cargo, passed::Passed};

/// What a test prints at the start of a line that says what it left out, and why.
const NOT_RUN: &str = "not run here: ";

/// Programs beside which nothing runs: a window that is driven has to answer in time.
const ALONE: [&str; 1] = ["window"];

/// Programs that take minutes, the longest first: they begin before others, so that none is left alone at the end.
const LONG: [&str; 8] = [
    "triangle_contact",
    "equivalence",
    "scenes_that_ship",
    "audit_table",
    "validation",
    "readme",
    "whole_runs",
    "command_line",
];

/// Where a program stands in the order in which they begin.
fn turn_of(program: &Artifact) -> (bool, usize) {
    // Unit tests are short: they fill what is left at the end.
    let of_long = LONG.iter().position(|&name| name == program.name);
    (program.kind != "test", of_long.unwrap_or(LONG.len()))
}

/// The tests of one program, or of all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    /// Tests that passed.
    pub(crate) passed: usize,
    /// Tests that failed.
    pub(crate) failed: usize,
    /// Tests that are marked as ignored.
    pub(crate) ignored: usize,
    /// What tests left out on this machine, each once.
    pub(crate) not_run: BTreeSet<String>,
}

impl Counts {
    /// Reads them off the output of test programs.
    pub(crate) fn of(output: &str) -> Self {
        let mut counts = Self::default();
        for line in output.lines() {
            if let Some(what) = line.trim().strip_prefix(NOT_RUN) {
                counts.not_run.insert(what.to_owned());
            }
            let Some(result) = line.strip_prefix("test result: ") else { continue };
            for part in result.split([';', '.']) {
                let mut words = part.split_whitespace();
                let (Some(Ok(count)), Some(what)) =
                    (words.next().map(str::parse::<usize>), words.next())
                else {
                    continue;
                };
                match what {
                    "passed" => counts.passed += count,
                    "failed" => counts.failed += count,
                    "ignored" => counts.ignored += count,
                    _ => {}
                }
            }
        }
        counts
    }

    /// Adds those of another program.
    pub(crate) fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.ignored += other.ignored;
        self.not_run.extend(other.not_run);
    }
}

/// One program that was run.
struct Outcome {
    name: String,
    success: bool,
    counts: Counts,
}

/// Runs all test programs, as many at a time as there are processors but at most two: a program uses several
/// threads by itself, and waits at times. Their tests are added to `counts`. What runs beside them is waited for by `beside`, before
/// those that must be alone; its outcome comes second. Those that `passed` before, with nothing changed since, are not run again.
///
/// # Errors
/// The names of those that failed.
pub(crate) fn run<T>(
    mut programs: Vec<Artifact>,
    counts: &mut Counts,
    passed: &Passed,
    beside: impl FnOnce() -> T,
) -> (Result<(), String>, T) {
    let before = programs.len();
    programs.retain(|program| match passed.text(program) {
        Some(text) => {
            counts.add(Counts::of(&text));
            false
        }
        None => true,
    });
    if programs.len() < before {
        println!(
            "{} programs passed before, and nothing has changed since",
            before - programs.len()
        );
    }
    programs.sort_by_key(turn_of);
    let alone = programs.extract_if(.., |program| ALONE.contains(&program.name.as_str()));
    let alone: Vec<_> = alone.collect();
    let side_by_side = thread::available_parallelism().map_or(1, NonZeroUsize::get).min(2);
    let queue = Mutex::new(VecDeque::from(programs));
    let outcomes = Mutex::new(Vec::new());
    let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
    thread::scope(|scope| {
        for _ in 0..side_by_side {
            scope.spawn(|| {
                while let Some(program) = next() {
                    let outcome = run_one(&program, passed);
                    outcomes.lock().unwrap_or_else(PoisonError::into_inner).push(outcome);
                }
            });
        }
    });
    let beside = beside();
    let alone: Vec<_> = alone.iter().map(|program| run_one(program, passed)).collect();
    let mut failed = Vec::new();
    for outcome in
        outcomes.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().chain(alone)
    {
        if !outcome.success {
            failed.push(outcome.name);
        }
        counts.add(outcome.counts);
    }
    let outcome =
        if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join(", "))) };
    (outcome, beside)
}

/// Runs the examples in the documentation, which only cargo can.
///
/// # Errors
/// The status that cargo ended with.
pub(crate) fn documented(counts: &mut Counts) -> Result<(), String> {
    let mut command = cargo(&["test", "--workspace", "--doc", "--no-fail-fast"]);
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout);
    let found = Counts::of(&text);
    if output.status.success() {
        println!("examples in the documentation: {} passed", found.passed);
    } else {
        println!("{text}");
    }
    counts.add(found);
    if output.status.success() { Ok(()) } else { Err("failed: documentation".into()) }
}

/// Runs one as cargo would, in the folder of its package, and prints a line; all of its output if it failed.
fn run_one(program: &Artifact, passed: &Passed) -> Outcome {
    let package = program.package.file_name().unwrap_or_default().to_string_lossy();
    let name = format!("{package}/{} ({})", program.name, program.kind);
    let mut command = Command::new(&program.path);
    // What a passed test prints says what it left out.
    command.arg("--show-output").current_dir(&program.package).stdin(Stdio::null());
    command.env("CARGO_MANIFEST_DIR", &program.package);
    let start = Instant::now();
    let (text, success) = match command.output() {
        Ok(output) => {
            let streams = [output.stdout, output.stderr];
            let text = streams.map(|stream| String::from_utf8_lossy(&stream).into_owned());
            (text.concat(), output.status.success())
        }
        Err(error) => (format!("it did not start: {error}\n"), false),
    };
    let time = start.elapsed().as_secs_f64();
    let counts = Counts::of(&text);
    if success {
        println!("{name}: {} passed, {time:.1} s", counts.passed);
        passed.note(program, &text);
    } else {
        println!("{text}\n{name}: FAILED, {time:.1} s");
    }
    Outcome { name, success, counts }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn results_of_programs_are_added_up_and_what_did_not_run_is_named_once() {
        let output = "running 3 tests\nnot run here: cuda: no driver\n\
            test result: FAILED. 12 passed; 1 failed; 2 ignored; 0 measured; 3 filtered out; finished in 0.01s\n";
        let mut counts = Counts::of(output);
        assert_eq!((counts.passed, counts.failed, counts.ignored), (12, 1, 2));
        counts.add(Counts::of(output));
        assert_eq!((counts.passed, counts.failed, counts.ignored), (24, 2, 4));
        assert_eq!(counts.not_run.into_iter().collect::<Vec<_>>(), ["cuda: no driver"]);
    }

    fn program(name: &str, kind: &str) -> Artifact {
        Artifact {
            name: name.into(),
            kind: kind.into(),
            is_test: true,
            path: PathBuf::from(name),
            package: std::env::temp_dir(),
        }
    }

    #[test]
    fn long_programs_begin_first_and_unit_tests_last() {
        let of = |name, kind| turn_of(&program(name, kind));
        assert!(of(LONG[0], "test") < of(LONG[1], "test"));
        assert!(of(LONG[7], "test") < of("seams", "test"));
        assert!(of("seams", "test") < of("cloth", "lib"));
    }

    /// A program that fails is named, and the others run all the same.
    #[cfg(unix)]
    #[test]
    fn a_program_that_fails_is_named() {
        let programs = ["true", "false", "no-such-program"].map(|name| program(name, "test"));
        let programs = programs.to_vec();
        let passed = Passed::default();
        let (outcome, beside) = run(programs, &mut Counts::default(), &passed, || "waited for");
        assert_eq!(beside, "waited for");
        let reason = outcome.unwrap_err();
        assert!(reason.contains("/false (test)"), "{reason}");
        assert!(reason.contains("/no-such-program (test)"), "{reason}");
        assert!(!reason.contains("/true (test)"), "{reason}");
    }
}
