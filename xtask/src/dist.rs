//! `cargo xtask dist`: programs for a GPU machine that has no Rust.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Stdio,
};

use crate::command::cargo;

/// Runs everything and prints a short table. Logs stay beside it.
const SCRIPT: &str = r#"#!/bin/sh
# Runs the tests, the benchmark and the program of this folder on a machine with an NVIDIA GPU.
# NVRTC is looked for in the usual places; LD_LIBRARY_PATH can name others.
cd "$(dirname "$0")" || exit 1
for folder in /usr/local/cuda*/lib64 /usr/local/cuda*/targets/*/lib; do
    [ -e "$folder/libnvrtc.so.13" ] && LD_LIBRARY_PATH="$folder:$LD_LIBRARY_PATH"
done
export LD_LIBRARY_PATH CLOTH_REQUIRE_CUDA=1 CLOTH_LEAVE_OUT="${CLOTH_LEAVE_OUT-wgpu}"
failed=0
row() {
    if "$@" >"$name.log" 2>&1; then result=passed; else result=FAILED; failed=1; fi
    printf '%-14s %s\n' "$name" "$result"
}
name=program; row ./cloth backends
name=drape; row ./cloth run drape --backend cuda --frames 5 --format none --out drape.out
for name in equivalence validation bad_input; do row "./$name"; done
name=cuda-bench; row ./cuda-bench
cat cuda-bench.log
exit $failed
"#;

/// Builds and gathers; whether it succeeded.
pub(crate) fn run() -> bool {
    match gather() {
        Ok(folder) => {
            println!("{}: copy it to the GPU machine and run ./run.sh there", folder.display());
            true
        }
        Err(reason) => {
            eprintln!("dist: {reason}");
            false
        }
    }
}

fn gather() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."));
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let folder = target.join("dist");
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let builds: [&[&str]; 3] = [
        &["build", "--release", "--package", "cloth-cli"],
        &["test", "--no-run", "--package", "cloth-tests"],
        &["bench", "--no-run", "--package", "cloth-benches", "--bench", "cuda"],
    ];
    for arguments in builds {
        for (name, path) in executables(arguments)? {
            let name = if name == "cuda" { "cuda-bench" } else { &name };
            fs::copy(&path, folder.join(name)).map_err(|error| format!("{name}: {error}"))?;
        }
    }
    let script = folder.join("run.sh");
    fs::write(&script, SCRIPT).map_err(|error| error.to_string())?;
    executable(&script).map_err(|error| error.to_string())?;
    Ok(folder)
}

/// Builds, and gives name and place of each program that came of it.
fn executables(arguments: &[&str]) -> Result<Vec<(String, PathBuf)>, String> {
    let mut command = cargo(arguments);
    command.args(["--message-format", "json-render-diagnostics"]).stderr(Stdio::inherit());
    let output = command.output().map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(format!("cargo {}: {}", arguments.join(" "), output.status));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let messages = text.lines().filter_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        let path = PathBuf::from(message.get("executable")?.as_str()?);
        Some((message.get("target")?.get("name")?.as_str()?.to_owned(), path))
    });
    Ok(messages.collect())
}

#[cfg(unix)]
fn executable(path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn executable(_: &Path) -> std::io::Result<()> {
    Ok(())
}
