//! `cargo xtask kernels`.

use std::{fs, path::Path, process::Command};

use crate::{
    artifacts,
    command::{self, cargo},
    packages,
};

/// The examples that compile CUDA kernels: those of the backend, and those of the ladder among the benchmarks.
pub(crate) const EXAMPLES: [&str; 2] = ["kernels", "ladder_kernels"];

/// Compiles CUDA kernels with NVIDIA's run-time compiler, which needs no GPU, through `program`, one of [`EXAMPLES`]. The
/// WGSL kernels are checked by a test of the package that holds them. With every set of options if it is to be `all`.
///
/// # Errors
/// Why it failed.
pub(crate) fn check(program: &Path, all: bool) -> Result<(), String> {
    let mut check = Command::new(program);
    check.args(all.then_some("--all"));
    if cfg!(target_os = "linux") && std::env::var_os("CLOTH_NVRTC").is_none_or(|v| v != "system") {
        let folder = nvrtc()?;
        let mut path = folder.into_os_string();
        if let Some(before) = std::env::var_os("LD_LIBRARY_PATH") {
            path.push(":");
            path.push(before);
        }
        check.env("LD_LIBRARY_PATH", path);
    }
    command::run(&mut check)
}

/// The folder of the compiler's library, from the package on PyPI, fetched once into the build folder. With
/// `CLOTH_NVRTC=system` the one of this machine is used instead.
fn nvrtc() -> Result<std::path::PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."));
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), Into::into);
    let folder = target.join("nvrtc");
    let library = folder.join("nvidia/cu13/lib");
    if library.join("libnvrtc.so.13").is_file() {
        return Ok(library);
    }
    pip_ensure()?;
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let mut install = Command::new("python3");
    install.args(["-m", "pip", "install", "--quiet", "--no-deps", "--target"]).arg(&folder);
    install.arg(NVRTC_PACKAGE);
    command::run(&mut install).map_err(|error| {
        format!(
            "NVRTC, NVIDIA's compiler for kernels, could not be fetched ({error}): run `python3 -m pip \
             install --no-deps --target {} {NVRTC_PACKAGE}`, or set CLOTH_NVRTC=system to use one that is \
             installed",
            folder.display()
        )
    })?;
    Ok(library)
}

/// Installs pip if it is not there and that can be done here.
fn pip_ensure() -> Result<(), String> {
    let is_there = || {
        let pip = Command::new("python3").args(["-m", "pip", "--version"]).output();
        pip.is_ok_and(|output| output.status.success())
    };
    let need = "pip, which fetches NVIDIA's compiler for kernels, is missing";
    packages::ensure(need, &PIP_PACKAGES, is_there)
}

/// Checks those in WGSL and those in CUDA, each by what its package has for that.
fn all() -> Result<(), String> {
    command::run(&mut cargo(&["test", "--quiet", "--package", "cloth-kernels"]))?;
    let mut arguments =
        vec!["build", "--package", "cloth-backend-cuda", "--package", "cloth-benches"];
    arguments.extend(EXAMPLES.iter().flat_map(|name| ["--example", name]));
    artifacts::build(&arguments)?.iter().try_for_each(|program| check(&program.path, true))
}

/// The Debian packages of pip.
const PIP_PACKAGES: [&str; 2] = ["python3", "python3-pip"];

/// The package on PyPI that holds the compiler.
const NVRTC_PACKAGE: &str = "nvidia-cuda-nvrtc==13.0.*";

/// Checks all kernels; whether they are valid.
pub(crate) fn run() -> bool {
    match all() {
        Ok(()) => true,
        Err(reason) => {
            eprintln!("kernels: {reason}");
            false
        }
    }
}
