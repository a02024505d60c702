//! What a compilation may do.

use std::path::PathBuf;

/// What a compilation may read and how much memory its result may need.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompileOptions {
    /// Further folders in which meshes are looked for, after that of the scene file. Absolute paths
    /// of meshes are allowed if they start with one of these.
    pub mesh_roots: Vec<PathBuf>,
    /// Lets the scene name any file as a mesh: absolute paths and `..`. Off by default, so that a
    /// scene from elsewhere cannot read what it likes.
    pub mesh_anywhere: bool,
    /// Bytes of memory that model and solver may need together, by
    /// [`Scene::memory_estimate`](crate::Scene::memory_estimate); 16 GiB by default.
    pub memory_limit: u64,
}

/// How far the part of a compilation is that can take minutes: the distances of solids, at samples around them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CompileProgress {
    /// Samples that are known, of all solids together.
    pub done: u64,
    /// All samples.
    pub total: u64,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self { mesh_roots: Vec::new(), mesh_anywhere: false, memory_limit: 16 << 30 }
    }
}
