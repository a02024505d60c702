//! Running cargo in the root of the repository.

use std::{
    path::Path,
    process::{Command, Stdio},
};

/// A cargo command in the root of the repository, whatever the current directory is.
pub(crate) fn cargo(arguments: &[&str]) -> Command {
    // Cargo tells its children which cargo it is, toolchain selection included.
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root()).stdin(Stdio::null());
    command
}

/// The root of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// The revision of the sources, if they are under version control.
pub(crate) fn revision() -> Option<String> {
    let describe = ["describe", "--always", "--dirty"];
    let output = Command::new("git").args(describe).current_dir(root()).output().ok()?;
    let text = String::from_utf8(output.stdout).ok().filter(|_| output.status.success())?;
    Some(text.trim().to_owned())
}

/// Runs a command to its end; its output goes to the terminal.
///
/// # Errors
/// Why it did not start, or the status it ended with.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(status.to_string()),
        Err(error) => Err(format!("{}: {error}", command.get_program().display())),
    }
}
