//! Scenes by the word that a user gives: the name of a built-in one or a path.

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use cloth::{
    Precision,
    scene::{CompileOptions, CompiledScene, Scene, ScenePrecision, builtin_scenes},
};

use crate::{arguments::SceneArguments, failure::Failure, memory, solid_progress::SolidProgress};

/// A scene and what its compilation may read.
pub(crate) struct SceneSource {
    pub(crate) scene: Scene,
    pub(crate) options: CompileOptions,
    /// The file, unless the scene is a built-in one.
    pub(crate) path: Option<PathBuf>,
}

impl SceneSource {
    /// Reads the scene and puts the values of the command line in place of its own.
    pub(crate) fn read(arguments: &SceneArguments) -> Result<Self, Failure> {
        let path = scene_path(&arguments.scene);
        let mut scene = match path {
            Some(path) => Scene::read(path)?,
            None => Scene::builtin(&arguments.scene)?,
        };
        if let Some(frames) = arguments.frames {
            scene.simulation.frames = frames;
        }
        if let Some(precision) = arguments.precision {
            scene.simulation.precision = match precision {
                Precision::F32 => ScenePrecision::F32,
                Precision::F64 => ScenePrecision::F64,
            };
        }
        arguments.solver.apply(&mut scene)?;
        let options = CompileOptions {
            mesh_roots: arguments.mesh_root.clone(),
            // `memory::check` asks what this machine has.
            memory_limit: u64::MAX,
            ..CompileOptions::default()
        };
        Ok(Self { scene, options, path: path.map(Path::to_owned) })
    }

    /// Compiles the scene if the memory of this machine is enough for it.
    pub(crate) fn compile(&self, threads: Option<NonZeroUsize>) -> Result<CompiledScene, Failure> {
        memory::check(&self.scene, &self.options)?;
        let progress = SolidProgress::default();
        let compiled = self.scene.compile_watched(&self.options, &|now| progress.show(now));
        progress.finish();
        let mut compiled = compiled?;
        compiled.config.threads = threads;
        Ok(compiled)
    }
}

/// Extensions of scene files.
pub(crate) const SCENE_EXTENSIONS: &[&str] = &["toml", "fysl", "xml"];

/// The file that a word means, or `None` for a built-in scene. That one goes before a file of the same name: which is `./name`.
fn scene_path(word: &str) -> Option<&Path> {
    let path = Path::new(word);
    let is_builtin = builtin_scenes().iter().any(|builtin| builtin.name == word);
    let is_path = path.components().count() > 1
        || path
            .extension()
            .is_some_and(|extension| SCENE_EXTENSIONS.iter().any(|e| extension == *e))
        || path.exists();
    (is_path && !is_builtin).then_some(path)
}
