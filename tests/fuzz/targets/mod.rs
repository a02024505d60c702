//! What reads inputs, and what it promises of those that it accepts.

mod expression;
mod mesh;
mod scene;
mod state;
mod trap;

use std::{num::NonZeroUsize, sync::LazyLock};

use cloth::{Backend, BackendOptions, backend_open};
use fastrand::Rng;
use tempfile::TempDir;

/// A reader of inputs.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// An input.
    pub(crate) make: fn(&mut Rng) -> Vec<u8>,
    /// Reads it; whether it was accepted. Panics if what was accepted is not what was promised.
    pub(crate) run: fn(&[u8]) -> bool,
    /// Whether it does harm on purpose, to show that harm is seen.
    pub(crate) is_trap: bool,
}

const TARGETS: [Target; 10] = [
    Target::new("toml", scene::toml_make, scene::toml_run),
    Target::new("fysl", scene::fysl_make, scene::fysl_run),
    Target::new("expression", expression::make, expression::run),
    Target::new("obj", mesh::obj_make, mesh::obj_run),
    Target::new("ply", mesh::ply_make, mesh::ply_run),
    Target::new("gltf", mesh::gltf_make, mesh::gltf_run),
    Target::new("checkpoint", state::checkpoint_make, state::checkpoint_run),
    Target::new("frames", state::frames_make, state::frames_run),
    Target::new("poses", state::poses_make, state::poses_run),
    Target { is_trap: true, ..Target::new("trap", trap::make, trap::run) },
];

impl Target {
    const fn new(
        name: &'static str,
        make: fn(&mut Rng) -> Vec<u8>,
        run: fn(&[u8]) -> bool,
    ) -> Self {
        Self { name, make, run, is_trap: false }
    }
}

/// All of them.
pub(crate) const fn all() -> &'static [Target] {
    &TARGETS
}

pub(crate) fn named(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// The input with this number of a seed, which follows from nothing else.
pub(crate) fn input(target: &Target, seed: u64, number: u64) -> Vec<u8> {
    let name = target.name.bytes().fold(0, |sum: u64, byte| sum * 31 + u64::from(byte));
    // Weyl's sequence: neighbours have little in common (constants of SplitMix64, Steele et al. 2014).
    let mixed = seed
        .wrapping_mul(0xbf58_476d_1ce4_e5b9)
        .wrapping_add(name.wrapping_mul(0x94d0_49bb_1331_11eb))
        .wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    (target.make)(&mut Rng::with_seed(mixed))
}

/// Files that scenes name, and those that inputs are put into.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap_or_else(|error| panic!("no temporary folder: {error}"));
    for (name, text) in mesh::FILES {
        let written = std::fs::write(folder.path().join(name), text);
        written.unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    folder
});

/// The backend that all inputs are computed with.
fn backend() -> &'static dyn Backend {
    static BACKEND: LazyLock<Box<dyn Backend>> = LazyLock::new(|| {
        let options = BackendOptions { threads: NonZeroUsize::new(1), ..BackendOptions::default() };
        backend_open("cpu", &options).unwrap_or_else(|error| panic!("no backend: {error}"))
    });
    BACKEND.as_ref()
}

/// Makes what inputs share, before limits count.
pub(crate) fn prepare() {
    for target in TARGETS.iter().filter(|target| !target.is_trap) {
        let _ = (target.run)(&input(target, 0, 0));
    }
}
