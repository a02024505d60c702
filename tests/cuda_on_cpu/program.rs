//! A kernel of a frame as a program of this machine.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use cloth_core::State;
use cloth_kernels::CudaModule;
use harness::checks::PatchFrames;

use crate::scene;

/// Modules whose frames can leave the state that they begin with as it is.
const KEEPING: [&str; 2] = ["explicit_substep_contact", "explicit_substep_flat"];

/// Shared parts that the runtime has in its own way, and those of linear systems, which the kernels of frames do without.
const NOT_HERE: [&str; 7] = ["ptx", "linear", "sum", "solve", "resident", "patch", "constraint"];

/// A form of the frame kernel.
pub(crate) struct Form {
    pub(crate) module: &'static str,
    pub(crate) options: &'static [&'static str],
    /// Whether blocks have runs of particles, not of tiles.
    pub(crate) is_mesh: bool,
    pub(crate) threads: u32,
}

/// It, compiled.
pub(crate) struct Program {
    path: PathBuf,
    threads: u32,
    folder: tempfile::TempDir,
}

impl Program {
    /// Compiles a form of the kernel, its text changed by `edit`.
    pub(crate) fn of(form: &Form, edit: impl Fn(String) -> String) -> Self {
        let module = CudaModule::find(form.module).expect("the module exists");
        let kernel = module
            .compose_with(form.options.to_vec(), &NOT_HERE.map(|part| (part, "")))
            .expect("the module has these options")
            // The runtime has it.
            .replace("extern __shared__ __align__(16) unsigned char frame_memory[];", "");
        let folder = tempfile::tempdir().expect("there is room for temporary files");
        let mesh = if form.is_mesh { "#define FRAME_OF_MESH\n" } else { "" };
        let keeps = if KEEPING.contains(&form.module) { "#define FRAME_KEEPS_FIRST\n" } else { "" };
        let text = format!(
            "#include \"runtime.h\"\n{}\n{mesh}{keeps}#include \"frame.h\"\n",
            edit(kernel)
        );
        let source = folder.path().join("kernel.cpp");
        fs::write(&source, text).expect("the source can be written");
        let path = folder.path().join("kernel");
        let compiler = env::var_os("CXX").unwrap_or_else(|| "c++".into());
        let headers = Path::new(env!("CARGO_MANIFEST_DIR")).join("cuda_on_cpu");
        let mut command = Command::new(&compiler);
        // Arithmetic as it is written, as in the reproducible mode of the device.
        command.args(["-std=c++20", "-O1", "-ffp-contract=off", "-w", "-pthread", "-I"]);
        let output = command.arg(headers).arg(&source).arg("-o").arg(&path).output();
        let output = output.unwrap_or_else(|error| {
            panic!(
                "no C++ compiler {}: {error}; run: sudo apt-get install --yes g++",
                compiler.display()
            )
        });
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(
            output.status.success(),
            "{} {:?} does not compile:\n{log}",
            form.module,
            form.options
        );
        Self { path, threads: form.threads, folder }
    }

    /// The state at the end of all frames, and contacts in the last substeps of all.
    pub(crate) fn run(&self, patch: &PatchFrames, blocks: u32, seed: u32) -> (State, u64) {
        let [input, output] = ["input", "output"].map(|name| self.folder.path().join(name));
        fs::write(&input, bytemuck::cast_slice(&scene::words(patch)))
            .expect("the input can be written");
        let mut command = Command::new(&self.path);
        command.args([&input, &output]);
        command.args([blocks, self.threads, seed].map(|number| number.to_string()));
        let ran = command.output().expect("the program starts");
        assert!(ran.status.success(), "the program ended with {}", ran.status);
        let contacts = String::from_utf8_lossy(&ran.stdout).trim().parse();
        let bytes = fs::read(&output).expect("the output is there");
        let numbers: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
        (scene::state(&numbers), contacts.expect("the program counts contacts"))
    }
}
