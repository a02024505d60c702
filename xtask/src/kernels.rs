//! `cargo xtask kernels`.

use crate::command::{self, cargo};

/// Checks the sources of all GPU kernels.
///
/// # Errors
/// Why it failed.
pub(crate) fn check() -> Result<(), String> {
    // A test of the package that holds them: it composes each module and gives it to naga.
    command::run(&mut cargo(&["test", "--quiet", "--package", "cloth-kernels"]))
}

/// Checks them; whether they are valid.
pub(crate) fn run() -> bool {
    match check() {
        Ok(()) => true,
        Err(reason) => {
            eprintln!("kernels: {reason}");
            false
        }
    }
}
