//! The kernels of the rungs, and how they are compiled.

use cloth::{Error, Result};
use cudarc::nvrtc::{self, CompileError, CompileOptions, Ptx};

/// A CUDA file of the folder `kernels`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Source {
    name: &'static str,
    text: &'static str,
}

pub(super) const NAIVE: Source = Source { name: "naive", text: include_str!("kernels/naive.cu") };
pub(super) const CONSTANTS: Source =
    Source { name: "constants", text: include_str!("kernels/constants.cu") };
pub(super) const MATH: Source = Source { name: "math", text: include_str!("kernels/math.cu") };
pub(super) const BINS: Source = Source { name: "bins", text: include_str!("kernels/bins.cu") };

/// All of them.
const SOURCES: [Source; 4] = [NAIVE, CONSTANTS, MATH, BINS];

/// What comes before each.
const SHARED: &str = include_str!("kernels/ladder.cuh");

impl Source {
    /// The error that says why it is of no use.
    pub(super) const fn failed(self, log: String) -> Error {
        Error::KernelCompile { kernel: self.name, log }
    }

    /// Compiles it for an architecture, such as `sm_90`.
    ///
    /// # Errors
    /// `KernelCompile` with the messages of the compiler; `NoDevice` if that is missing.
    pub(super) fn compile(self, architecture: &str) -> Result<Ptx> {
        if !is_compiler_present() {
            let reason = "NVRTC, NVIDIA's compiler for kernels, is missing: LD_LIBRARY_PATH has to name the folder of \
                          libnvrtc.so.13";
            return Err(Error::NoDevice { backend: "cuda", reason: reason.into() });
        }
        // As the backend has its own compiled: each operation is rounded once, as on the processor.
        let options = CompileOptions {
            fmad: Some(false),
            prec_div: Some(true),
            prec_sqrt: Some(true),
            ftz: Some(false),
            options: vec![format!("--gpu-architecture={architecture}"), "--std=c++17".into()],
            name: Some(format!("{}.cu", self.name)),
            ..CompileOptions::default()
        };
        nvrtc::compile_ptx_with_opts([SHARED, self.text].concat(), options).map_err(|error| {
            self.failed(match error {
                CompileError::CompileError { nvrtc, log, .. } => {
                    format!("{nvrtc}\n{}", log.to_string_lossy())
                }
                other => other.to_string(),
            })
        })
    }
}

/// Whether NVRTC can be opened: all that is called of it panics without.
#[expect(unsafe_code, reason = "it opens a library")]
fn is_compiler_present() -> bool {
    // SAFETY: it only tries to open the compiler of NVIDIA, of which no code runs before it is called.
    unsafe { nvrtc::sys::is_culib_present() }
}

/// Compiles the kernels of all rungs for an architecture, such as `sm_90`, as a check: needs NVRTC, but no GPU. Returns
/// how many files that were.
///
/// # Errors
/// [`Error::KernelCompile`] for the first that fails; [`Error::NoDevice`] if the compiler is missing.
pub fn kernels_compile(architecture: &str) -> Result<usize> {
    for source in SOURCES {
        source.compile(architecture)?;
    }
    Ok(SOURCES.len())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn every_file_is_compiled() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/ladder/kernels");
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = files.filter(|file| file.extension().is_some_and(|e| e == "cu"));
        let found: BTreeSet<_> =
            files.map(|file| file.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
        assert_eq!(found, SOURCES.iter().map(|source| source.name.to_owned()).collect());
    }
}
