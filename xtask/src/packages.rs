//! Debian packages that tests need.

use std::process::Command;

use crate::command;

/// Installs packages, which needs root and a Debian system.
///
/// # Errors
/// Why that failed.
pub(crate) fn install(packages: &[&str]) -> Result<(), String> {
    println!("installing {}", packages.join(" "));
    command::run(&mut apt_get(&["update", "--quiet"]))?;
    let mut arguments = vec!["install", "--quiet", "--yes", "--no-install-recommends"];
    arguments.extend(packages);
    command::run(&mut apt_get(&arguments))
}

/// Installs packages of which something is missing, if that can be done here. Other systems than Linux are
/// not asked.
///
/// # Errors
/// What is needed, and the one line that installs it.
pub(crate) fn ensure(
    need: &str,
    packages: &[&str],
    is_there: impl Fn() -> bool,
) -> Result<(), String> {
    if !cfg!(target_os = "linux") || is_there() {
        return Ok(());
    }
    match install(packages) {
        Ok(()) if is_there() => Ok(()),
        _ => Err(format!("{need}; run: {}", install_line(packages))),
    }
}

/// Whether a program can be started by its name.
pub(crate) fn has_program(name: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| folder.join(name).is_file())
}

/// The line with which the user installs them.
pub(crate) fn install_line(packages: &[&str]) -> String {
    format!("sudo apt-get install --yes {}", packages.join(" "))
}

fn apt_get(arguments: &[&str]) -> Command {
    let mut command = Command::new("apt-get");
    command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
    command
}
