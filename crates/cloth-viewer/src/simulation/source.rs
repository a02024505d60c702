//! What can be opened.

use std::path::{Path, PathBuf};

use cloth::{
    io::FrameStore,
    scene::{CompileOptions, Scene, builtin_scenes},
    topology,
};

use super::FrameFiles;
use crate::ViewerError;

/// Something to look at.
#[derive(Clone, Debug)]
pub enum Source {
    /// A scene to simulate.
    Scene(Box<Scene>, CompileOptions),
    /// The frames that `cloth run` wrote, with the scene that they are of.
    Run {
        /// The scene.
        scene: Box<Scene>,
        /// Where its meshes are.
        options: CompileOptions,
        /// The frame store.
        store: PathBuf,
    },
    /// Frames of which nothing else is known.
    Files(FrameFiles),
}

impl Source {
    /// What a word means: the name of a built-in scene, the path of a scene, the output folder of a
    /// run or its frame store, a point cache, one mesh of a sequence or a folder of them.
    ///
    /// # Errors
    /// [`ViewerError::Scene`] or [`ViewerError::Source`].
    pub fn open(word: &str) -> Result<Self, ViewerError> {
        let path = Path::new(word);
        if builtin_scenes().iter().any(|builtin| builtin.name == word) || !path.exists() {
            let is_path = path.components().count() > 1 || path.extension().is_some();
            let scene = if is_path { Scene::read(path)? } else { Scene::builtin(word)? };
            return Ok(Self::Scene(Box::new(scene), CompileOptions::default()));
        }
        Self::open_path(path)
    }

    /// As [`Self::open`], for what was dropped onto the window or chosen in a dialog.
    ///
    /// # Errors
    /// [`ViewerError::Scene`] or [`ViewerError::Source`].
    pub fn open_path(path: &Path) -> Result<Self, ViewerError> {
        if path.is_dir() {
            // A folder that a run wrote says so by its scene, and then is to blame for what is wrong.
            let is_run = path.join("frames.bin").exists() || path.join("scene.toml").exists();
            return match FrameFiles::of_folder(path)? {
                Some(files) if !is_run => Ok(Self::Files(files)),
                _ => Self::run(path),
            };
        }
        if path.extension().is_some_and(|extension| extension == "bin") {
            return Self::run(path.parent().unwrap_or(Path::new(".")));
        }
        if FrameFiles::knows(path) {
            return Ok(Self::Files(FrameFiles::of_file(path)?));
        }
        Ok(Self::Scene(Box::new(Scene::read(path)?), CompileOptions::default()))
    }

    /// Whether it can be shown, as far as that can be told without a device.
    ///
    /// # Errors
    /// [`ViewerError::Scene`], [`ViewerError::Frames`] or [`ViewerError::Source`].
    pub fn check(&self) -> Result<(), ViewerError> {
        match self {
            Self::Scene(scene, options) => {
                scene.compile(options)?;
            }
            Self::Run { scene, options, store } => {
                FrameStore::open_read_only(store, &topology(&scene.compile(options)?))?;
            }
            Self::Files(files) => {
                files.frame(0, files.mesh()?.positions.len())?;
            }
        }
        Ok(())
    }

    /// Name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Scene(scene, _) | Self::Run { scene, .. } => &scene.name,
            Self::Files(files) => files.name(),
        }
    }

    /// The folder of the scene file, if it is of one.
    #[must_use]
    pub fn folder(&self) -> Option<PathBuf> {
        match self {
            Self::Scene(scene, _) => {
                let folder = &scene.origin.directory;
                (!folder.as_os_str().is_empty()).then(|| folder.clone())
            }
            Self::Run { .. } | Self::Files(_) => None,
        }
    }

    fn run(folder: &Path) -> Result<Self, ViewerError> {
        let fail = |problem: String| ViewerError::Source { path: folder.to_owned(), problem };
        let store = folder.join("frames.bin");
        if !store.is_file() {
            return Err(fail("it has no `frames.bin`".into()));
        }
        // Its meshes are in the folder, too: nothing outside of it is read.
        let scene = Scene::read(&folder.join("scene.toml"))?;
        // It was run before, so it is not too large.
        let options = CompileOptions { memory_limit: u64::MAX, ..CompileOptions::default() };
        Ok(Self::Run { scene: Box::new(scene), options, store })
    }
}
