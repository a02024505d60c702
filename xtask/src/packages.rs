//! Debian packages that tests need.

use std::process::Command;

use crate::command;

/// Installs `packages` unless `is_there`, where that can be done.
///
/// # Errors
/// `need`, and the one line that installs them.
pub(crate) fn ensure(need: &str, packages: &[&str], is_there: fn() -> bool) -> Result<(), String> {
    if is_there() {
        return Ok(());
    }
    println!("{need}, installing {}", packages.join(" "));
    let mut apt = apt_get(&["update", "--quiet"]);
    let installed = command::run(&mut apt).and_then(|()| {
        let mut arguments = vec!["install", "--quiet", "--yes", "--no-install-recommends"];
        arguments.extend(packages);
        command::run(&mut apt_get(&arguments))
    });
    match installed {
        Ok(()) if is_there() => Ok(()),
        _ => Err(format!("{need}; run: sudo apt-get install --yes {}", packages.join(" "))),
    }
}

fn apt_get(arguments: &[&str]) -> Command {
    let mut command = Command::new("apt-get");
    command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
    command
}
