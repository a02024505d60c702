//! The C++ compiler of this machine. What it has made stays in the target folder, under a name made of all that it was made of.

use std::{
    env,
    ffi::OsString,
    fs,
    hash::{DefaultHasher, Hash, Hasher},
    path::{Path, PathBuf},
    process::{Command, id},
    sync::{
        LazyLock,
        atomic::{AtomicU32, Ordering},
    },
};

/// Arithmetic as it is written, as in the reproducible mode of the device. Checked jumps would not let a fiber go on.
const OPTIONS: [&str; 6] =
    ["-std=c++20", "-O1", "-ffp-contract=off", "-w", "-pthread", "-U_FORTIFY_SOURCE"];

const RUNTIME: &str = include_str!("runtime.h");

fn compiler() -> OsString {
    env::var_os("CXX").unwrap_or_else(|| "c++".into())
}

/// What the compiler says it is.
static VERSION: LazyLock<String> =
    LazyLock::new(|| output(Command::new(compiler()).arg("--version")));

/// The folder with the header that all programs begin with, and its compiled form.
static HEADER: LazyLock<PathBuf> = LazyLock::new(|| {
    let made = made_of(RUNTIME, "runtime.h.gch", |source, made| {
        let mut command = Command::new(compiler());
        command.args(OPTIONS).args(["-x", "c++-header"]).arg(source).arg("-o").arg(made);
        output(&mut command);
    });
    let folder = made.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    // A compiler that takes no compiled header finds its text.
    fs::write(folder.join("runtime.h"), RUNTIME).expect("the header can be written");
    folder
});

/// The program with this text.
pub(crate) fn program(text: &str) -> PathBuf {
    made_of(text, "program", |source, made| {
        let mut command = Command::new(compiler());
        command.args(OPTIONS).arg("-I").arg(&*HEADER).arg(source).arg("-o").arg(made);
        output(&mut command);
    })
}

/// A file of this name that `make` makes of a text, the first time that it is asked for.
fn made_of(text: &str, name: &str, make: impl Fn(&Path, &Path)) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    (text, RUNTIME, OPTIONS, compiler(), &*VERSION).hash(&mut hasher);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("cuda_on_cpu")
        .join(format!("{:016x}", hasher.finish()));
    let made = folder.join(name);
    if !made.exists() {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        fs::create_dir_all(&folder).expect("there is room in the target folder");
        // Others may be about to make the same: each under a name of its own first.
        let source = folder.join(format!("{}-{number}.cpp", id()));
        let draft = folder.join(format!("{}-{number}", id()));
        fs::write(&source, text).expect("the source can be written");
        make(&source, &draft);
        fs::rename(&draft, &made).expect("a file can be renamed");
        fs::remove_file(&source).expect("the source can be removed");
    }
    made
}

/// What a command prints; it must succeed.
fn output(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| {
        let compiler = compiler();
        let compiler = compiler.display();
        panic!("no C++ compiler {compiler}: {error}; run: sudo apt-get install --yes g++")
    });
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?} fails:\n{log}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}
