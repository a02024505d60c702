//! Makes sure that there is a C++ compiler, with which the CUDA kernels of a frame are tested on the processor.

use crate::packages;

/// Installs one if there is none and that can be done here.
///
/// # Errors
/// The one line that installs it.
pub(crate) fn ensure() -> Result<(), String> {
    packages::ensure("the tests of CUDA kernels need a C++ compiler", &["g++"], is_there)
}

/// Whether there is the one that the tests take, or another is named.
fn is_there() -> bool {
    std::env::var_os("CXX").is_some() || packages::has_program("c++")
}
