//! What `cloth-fuzz` promises, and what its findings have become: it sees harm of all kinds, and none of what it found once is there.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;

fn fuzz(folder: &TempDir) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cloth-fuzz"));
    // What it keeps of runs that differ goes with the folder of the test.
    command.current_dir(folder.path()).env("TMPDIR", folder.path());
    command
}

fn text(output: &Output) -> String {
    [&output.stdout[..], &output.stderr].map(String::from_utf8_lossy).concat()
}

/// Every file that was kept does no harm any more.
#[test]
fn findings_of_the_past_are_mended() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/regressions");
    let folder = TempDir::new().unwrap();
    let output = fuzz(&folder).arg("replay").arg(kept).output().unwrap();
    assert!(output.status.success(), "{}", text(&output));
    assert!(!text(&output).contains("\n0 inputs"), "{}", text(&output));
}

/// A panic, one of another thread, a hang, memory without end and a stack without end are all found, made smaller and kept.
#[test]
fn harm_is_found_made_smaller_and_kept() {
    let folder = TempDir::new().unwrap();
    let mut command = fuzz(&folder);
    command.args(["--target", "trap", "--inputs", "40", "--seconds", "300", "--deadline", "1"]);
    let output = command.args(["--memory", "256", "--jobs", "2"]).output().unwrap();
    let said = text(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for words in ["a trap of", "a trap in a thread", "hang", "memory allocation", "overflow"] {
        assert!(said.contains(words), "nothing of `{words}` in\n{said}");
    }
    assert!(said.contains("without harm, 5 findings"), "{said}");
    let kept: Vec<Vec<u8>> = std::fs::read_dir(folder.path().join("fuzz-findings/trap"))
        .unwrap()
        .map(|entry| std::fs::read(entry.unwrap().path()).unwrap())
        .collect();
    assert!(kept.contains(&b"p".to_vec()), "not made as small as can be: {kept:?}");
    // What was kept does the same harm when it is read again.
    let replay = fuzz(&folder)
        .args(["replay", "fuzz-findings", "--deadline", "1", "--memory", "256"])
        .output();
    assert_eq!(replay.unwrap().status.code(), Some(1));
}

/// What is tried follows from the seed alone.
#[test]
fn a_seed_gives_the_same_inputs() {
    let tally = |seed: &str, jobs: &str| {
        let folder = TempDir::new().unwrap();
        let mut command = fuzz(&folder);
        command.args(["--inputs", "180", "--seconds", "300", "--seed", seed, "--jobs", jobs]);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", text(&output));
        // The first line has the number of jobs.
        text(&output).split_once('\n').unwrap().1.to_owned()
    };
    let first = tally("7", "1");
    assert!(first.contains("180 inputs without harm, 0 findings"), "{first}");
    assert_eq!(first, tally("7", "2"));
    assert_ne!(first, tally("8", "1"));
}

/// The program, which is built with all tests; another package has it, so that a test that is built alone may not find it.
fn program() -> Option<PathBuf> {
    let program = Path::new(env!("CARGO_BIN_EXE_cloth-fuzz")).with_file_name("cloth");
    let is_there = program.exists();
    if !is_there {
        println!("not run here: kills: `{}` was not built", program.display());
    }
    is_there.then_some(program)
}

/// Runs of all scenes with small patches on the processor, each killed about twice; `cargo xtask kills` kills more, on all backends.
const KILLS: [&str; 11] =
    ["kills", "--kills", "30", "--jobs", "2", "--backend", "cpu", "--side", "8", "--frames", "6"];

/// Whenever a run is killed, what it goes on to be is the run that was left alone.
#[test]
fn runs_that_are_killed_and_resumed_lose_nothing() {
    let Some(program) = program() else { return };
    let folder = TempDir::new().unwrap();
    let output = fuzz(&folder).args(KILLS).arg("--program").arg(program).output().unwrap();
    let said = text(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains(" 0 findings") && !said.contains(", 0 resumed"), "{said}");
}

/// A program that leaves a file behind, or computes other frames, when it goes on, is found out.
#[test]
fn runs_that_go_on_in_another_way_are_found() {
    use std::os::unix::fs::PermissionsExt;

    let Some(program) = program() else { return };
    for (harm, words) in [
        ("touch left.part", "`left.part` was left behind"),
        ("printf x | dd of=frames.bin bs=1 seek=99 conv=notrunc 2>/dev/null", "frames.bin` is"),
        ("rm poses.txt", "`poses.txt` is missing"),
    ] {
        let folder = TempDir::new().unwrap();
        let wrapper = folder.path().join("cloth");
        let script = format!(
            "#!/bin/sh\ncase \"$*\" in\n*--resume*|*--overwrite*)\n'{}' \"$@\" || exit $?\n\
             while [ \"$1\" != --out ]; do shift; done\ncd \"$2\" && {harm} ;;\n*) exec '{}' \"$@\" ;;\nesac\n",
            program.display(),
            program.display()
        );
        std::fs::write(&wrapper, script).unwrap();
        std::fs::set_permissions(&wrapper, std::fs::Permissions::from_mode(0o755)).unwrap();
        let mut command = fuzz(&folder);
        command.args(["kills", "--kills", "2", "--backend", "cpu", "--scene", "rigid-pair"]);
        let output = command.arg("--program").arg(&wrapper).output().unwrap();
        let said = text(&output);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.contains(words), "{words}:\n{said}");
    }
}
