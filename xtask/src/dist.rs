//! `cargo xtask dist`: the program, tests and benchmarks for a GPU machine that has no Rust.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::artifacts::{self, Artifact};

/// Runs everything and prints a short table. Logs stay beside it.
const SCRIPT: &str = r#"#!/bin/sh
# Runs the tests, the benchmarks and the program of this folder on a machine with an NVIDIA GPU that has no Rust.
# `./run.sh --quick` leaves the benchmarks out; `./run.sh --sanitize` only looks for errors of memory and races between threads, with
# compute-sanitizer of the CUDA toolkit, where that is in PATH or in a usual place. Logs are kept in the folder `logs`, the page of the benchmark in `bench`.
# NVRTC is looked for in the usual places; LD_LIBRARY_PATH can name others. What goes through Vulkan is left out, and listed as that,
# where Vulkan finds no NVIDIA GPU; CLOTH_LEAVE_OUT=wgpu leaves it out anywhere.
cd "$(dirname "$0")" || exit 1
for folder in /usr/local/cuda*/lib64 /usr/local/cuda*/targets/*/lib; do
    [ -e "$folder/libnvrtc.so.13" ] && LD_LIBRARY_PATH="$folder:$LD_LIBRARY_PATH"
done
export LD_LIBRARY_PATH CLOTH_REQUIRE_CUDA=1
mkdir -p logs
failed=0
row() {
    name=$1; shift
    started=$(date +%s)
    if "$@" >"logs/$name.log" 2>&1; then result=passed; else result=FAILED; failed=1; fi
    printf '%-16s %-8s %5s s\n' "$name" "$result" $(($(date +%s) - started))
    [ $result = passed ] || tail -n 5 "logs/$name.log" | sed 's/^/    /'
}
if [ "$1" = --sanitize ]; then
    PATH="$PATH:/usr/local/cuda/bin:/usr/local/cuda/compute-sanitizer"
    if ! command -v compute-sanitizer >/dev/null; then
        echo 'no compute-sanitizer; it is part of the CUDA toolkit; alone: sudo apt-get install --yes cuda-sanitizer-13-0' >&2
        exit 1
    fi
    # The tools know nothing of Vulkan.
    export CLOTH_LEAVE_OUT=wgpu
    for tool in memcheck racecheck; do
        row $tool compute-sanitizer --tool $tool --error-exitcode 1 ./equivalence --test-threads 1 cuda_sanitized
    done
    exit $failed
fi
left_out() { printf '%-16s left out: %s\n' "$1" "$2"; }
row program ./cloth backends
case ",$CLOTH_LEAVE_OUT," in
*,wgpu,*) reason='CLOTH_LEAVE_OUT says so' ;;
*)
    reason=
    if ! ./cloth backends 2>/dev/null | grep wgpu | grep -q NVIDIA; then
        reason='Vulkan finds no NVIDIA GPU here'
        CLOTH_LEAVE_OUT="${CLOTH_LEAVE_OUT:+$CLOTH_LEAVE_OUT,}wgpu"
    fi
    ;;
esac
export CLOTH_LEAVE_OUT
backends=cuda
[ -z "$reason" ] && backends='cuda wgpu'
for backend in $backends; do
    for solver in explicit implicit semi-implicit; do
        row "drape-$backend-$solver" ./cloth run drape --backend $backend --solver $solver --frames 5 --format none \
            --out "logs/drape-$backend-$solver"
    done
done
for name in equivalence validation bad_input ladder; do row $name "./$name"; done
if [ -z "$reason" ]; then row gpu ./gpu; else left_out gpu "$reason"; fi
if [ "$1" != --quick ]; then
    row cuda-bench ./cuda-bench
    row bench ./cloth-bench --suite full --out bench
    if [ -z "$reason" ]; then row gpu-bench ./gpu-bench; else left_out gpu-bench "$reason"; fi
    row workload-bench ./workload-bench
    cat logs/bench.log logs/cuda-bench.log
fi
exit $failed
"#;

/// Tests and benchmarks that are gathered; the others need the sources.
const TESTS: [&str; 4] = ["equivalence", "validation", "gpu", "bad_input"];
const BENCHES: [&str; 3] = ["cuda", "gpu", "workload"];

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
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let folder = root.join(target).join("dist");
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    let program = [
        "build",
        "--profile",
        "dist",
        "--package",
        "cloth-cli",
        "--features",
        "cuda,viewer",
        "--bin",
        "cloth",
    ];
    copy(&folder, &program, |name| name.to_owned())?;
    let bench =
        ["build", "--profile", "dist", "--package", "cloth-benches", "--bin", "cloth-bench"];
    copy(&folder, &bench, |name| name.to_owned())?;
    let mut tests = vec!["test", "--profile", "dist", "--no-run", "--package", "cloth-tests"];
    tests.extend(TESTS.iter().flat_map(|name| ["--test", name]));
    copy(&folder, &tests, |name| name.to_owned())?;
    // What needs the kernels of the ladder is a test of the benchmarks.
    let ladder =
        ["test", "--profile", "dist", "--no-run", "--package", "cloth-benches", "--test", "ladder"];
    copy(&folder, &ladder, |name| name.to_owned())?;
    let mut benches = vec!["bench", "--profile", "dist", "--no-run", "--package", "cloth-benches"];
    benches.extend(BENCHES.iter().flat_map(|name| ["--bench", name]));
    // A test has the name of a benchmark.
    copy(&folder, &benches, |name| format!("{name}-bench"))?;
    let script = folder.join("run.sh");
    fs::write(&script, SCRIPT).map_err(|error| error.to_string())?;
    executable(&script).map_err(|error| error.to_string())?;
    Ok(folder)
}

/// Builds, and copies each program that came of it under the name that `named` makes of its own.
fn copy(folder: &Path, arguments: &[&str], named: impl Fn(&str) -> String) -> Result<(), String> {
    for Artifact { name, path, .. } in artifacts::build(arguments)? {
        let name = named(&name);
        fs::copy(&path, folder.join(&name)).map_err(|error| format!("{name}: {error}"))?;
        println!("dist: {name}");
    }
    Ok(())
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
