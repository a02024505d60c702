//! A kernel of a frame as a program of this machine.

use std::{fs, path::PathBuf, process::Command};

use cloth_core::State;
use cloth_kernels::CudaModule;
use harness::checks::PatchFrames;

use crate::{compiler, scene};

/// Modules whose frames can leave the state that they begin with as it is.
const KEEPING: [&str; 1] = ["explicit_substep_flat"];

/// Shared parts that the runtime has in its own way, and those of linear systems, which the kernels of frames do without.
const NOT_HERE: [&str; 7] =
    ["ptx", "linear", "fabric_matrix", "sum", "schwarz", "solve", "constraint"];

/// What blocks of a form share out.
#[derive(Clone, Copy)]
pub(crate) enum Share {
    /// Tiles of the patch.
    Tiles,
    /// Runs of particles.
    Particles,
    /// The same; stages follow the pass. Regions of the strain limit have so many particles, or there are none.
    Stages(Option<usize>),
}

/// A form of the frame kernel.
pub(crate) struct Form {
    pub(crate) module: &'static str,
    pub(crate) options: &'static [&'static str],
    /// What blocks have.
    pub(crate) share: Share,
    pub(crate) threads: u32,
}

/// It, compiled.
pub(crate) struct Program {
    path: PathBuf,
    threads: u32,
    region: Option<usize>,
}

impl Program {
    /// Compiles a form of the kernel, its text changed by `edit`.
    pub(crate) fn of(form: &Form, edit: impl Fn(String) -> String) -> Self {
        let module = CudaModule::find(form.module).expect("the module exists");
        let kernel = module
            .compose_with(form.options.to_vec(), &NOT_HERE.map(|part| (part, "")))
            .expect("the module has these options");
        let mesh = match form.share {
            Share::Tiles => "",
            Share::Particles => "#define FRAME_OF_MESH\n",
            Share::Stages(_) => "#define FRAME_OF_STAGES\n",
        };
        let keeps = if KEEPING.contains(&form.module) { "#define FRAME_KEEPS_FIRST\n" } else { "" };
        let (kernel, frame) = (edit(kernel), include_str!("frame.h"));
        let text = format!("#include \"runtime.h\"\n{kernel}\n{mesh}{keeps}{frame}\n");
        let region = match form.share {
            Share::Stages(region) => region,
            Share::Tiles | Share::Particles => None,
        };
        Self { path: compiler::program(&text), threads: form.threads, region }
    }

    /// The state at the end of all frames, and contacts in the last substeps of all.
    pub(crate) fn run(&self, patch: &PatchFrames, blocks: u32, seed: u32) -> (State, u64) {
        let folder = tempfile::tempdir().expect("there is room for temporary files");
        let [input, output] = ["input", "output"].map(|name| folder.path().join(name));
        fs::write(&input, bytemuck::cast_slice(&scene::words(patch, self.region)))
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
