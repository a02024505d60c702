//! Makes sure that there is a virtual screen, on which the window is tested.

use crate::packages;

/// The Debian packages of the screen, and of the hand that uses it.
const PACKAGES: [&str; 2] = ["xvfb", "xdotool"];

/// Installs what is missing if that can be done here.
///
/// # Errors
/// The one line that installs it.
pub(crate) fn ensure() -> Result<(), String> {
    // The tests of the window are for X11.
    packages::ensure("the tests of the window need a virtual screen", &PACKAGES, is_there)
}

fn is_there() -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<_> = std::env::split_paths(&paths).collect();
    let has = |name: &str| folders.iter().any(|folder| folder.join(name).is_file());
    has("Xvfb") && has("xdotool")
}
