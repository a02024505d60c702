//! `cargo xtask bench`.

use std::ffi::OsString;

use crate::command;

/// Runs the benchmarks with `arguments` passed through; whether they succeeded.
pub(crate) fn run(arguments: impl Iterator<Item = OsString>) -> bool {
    let mut command = command::cargo(&["bench", "--package", "cloth-benches"]);
    match command::run(command.args(arguments)) {
        Ok(()) => true,
        Err(reason) => {
            eprintln!("bench: {reason}");
            false
        }
    }
}
