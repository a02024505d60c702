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
    ["Xvfb", "xdotool"].into_iter().all(packages::has_program)
}
