//! Where a run keeps what: one folder, from which it can be resumed and converted.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use cloth::{
    io::{FrameFormat, file_replace},
    scene::{CompileOptions, Scene},
};
use serde::{Deserialize, Serialize};

use crate::failure::{Failure, ReadError, WriteError};

/// The folder of a run.
#[derive(Clone, Debug)]
pub(crate) struct RunFolder {
    pub(crate) root: PathBuf,
    /// Start of the names of all outputs.
    name: String,
}

/// Where the meshes of the scene are, which the scene file in the folder cannot say.
#[derive(Debug, Serialize, Deserialize)]
struct Meshes {
    directory: PathBuf,
    roots: Vec<PathBuf>,
}

/// A folder that no run wrote, or that lost a file.
#[derive(Debug, thiserror::Error)]
#[error("`{}` is not the output folder of a run ({problem}); give the folder that `cloth run` wrote", folder.display())]
struct FolderError {
    folder: PathBuf,
    problem: String,
}

impl RunFolder {
    /// The folder `root` of a run of the scene called `scene_name`, or a folder named after it.
    pub(crate) fn new(root: Option<&Path>, scene_name: &str) -> Self {
        let name = file_name(scene_name);
        let root = root.map_or_else(|| Path::new("out").join(&name), Path::to_path_buf);
        Self { root, name }
    }

    /// All frames.
    pub(crate) fn store(&self) -> PathBuf {
        self.root.join("frames.bin")
    }

    pub(crate) fn checkpoint(&self) -> PathBuf {
        self.root.join("checkpoint.bin")
    }

    /// Reports of the frames, a line of JSON each.
    pub(crate) fn report(&self) -> PathBuf {
        self.root.join("report.jsonl")
    }

    /// Where rigid bodies were, a line for each frame.
    pub(crate) fn poses(&self) -> PathBuf {
        self.root.join("poses.txt")
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Folder of a format with one file per frame.
    pub(crate) fn sequence(&self, format: FrameFormat) -> PathBuf {
        self.root.join(format.name())
    }

    /// File of a format with all frames in one file.
    pub(crate) fn container(&self, format: FrameFormat) -> PathBuf {
        self.root.join(format!("{}.{}", self.name, format.extension()))
    }

    /// Writes the scene as it is run, values of the command line included.
    pub(crate) fn scene_write(
        &self,
        scene: &Scene,
        options: &CompileOptions,
    ) -> Result<(), Failure> {
        let absolute = |path: &Path| {
            let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
            std::path::absolute(path).map_err(ReadError::of(path))
        };
        let meshes = Meshes {
            directory: absolute(&scene.origin.directory)?,
            roots: options
                .mesh_roots
                .iter()
                .map(|root| absolute(root))
                .collect::<Result<_, _>>()?,
        };
        let meshes = serde_json::to_string_pretty(&meshes).map_err(Failure::other)?;
        text_write(&self.root.join("scene.toml"), &scene.to_toml()?)?;
        text_write(&self.root.join("meshes.json"), &meshes)
    }

    /// The scene that was run into the folder `root`.
    pub(crate) fn scene_read(root: &Path) -> Result<(Scene, CompileOptions), Failure> {
        let missing =
            |problem: String| Failure::input(FolderError { folder: root.to_owned(), problem });
        let path = root.join("meshes.json");
        let text = fs::read_to_string(&path)
            .map_err(|error| missing(format!("`meshes.json` cannot be read: {error}")))?;
        let meshes: Meshes = serde_json::from_str(&text)
            .map_err(|error| missing(format!("`meshes.json` is damaged: {error}")))?;
        let mut scene = Scene::read(&root.join("scene.toml"))?;
        scene.origin.directory = meshes.directory;
        let options = CompileOptions {
            mesh_roots: meshes.roots,
            memory_limit: u64::MAX,
            ..CompileOptions::default()
        };
        Ok((scene, options))
    }

    /// Removes what an earlier run wrote for frame `from` and later ones, and what holds all
    /// frames. Names that no run writes are left alone.
    pub(crate) fn outputs_remove(&self, from: u64) -> Result<(), WriteError> {
        for format in FrameFormat::ALL {
            if format.is_sequence() {
                self.sequence_remove(format, from)?;
            } else {
                file_remove(&self.container(format))?;
            }
        }
        let collection = format!("{}.pvd", self.name);
        file_remove(&self.sequence(FrameFormat::Vtu).join(collection))?;
        // The mesh that point caches move.
        file_remove(&self.root.join(format!("{}_mesh.obj", self.name)))
    }

    fn sequence_remove(&self, format: FrameFormat, from: u64) -> Result<(), WriteError> {
        let folder = self.sequence(format);
        // No folder, no files.
        let Ok(entries) = fs::read_dir(&folder) else { return Ok(()) };
        for entry in entries {
            let path = entry.map_err(WriteError::of(&folder))?.path();
            if self.frame_of(&path, format).is_some_and(|frame| frame >= from) {
                file_remove(&path)?;
            }
        }
        Ok(())
    }

    /// Number of the frame in a file of a sequence, by the names that `FrameSequenceWriter` gives.
    fn frame_of(&self, path: &Path, format: FrameFormat) -> Option<u64> {
        let digits = path
            .file_name()?
            .to_str()?
            .strip_prefix(&self.name)?
            .strip_prefix('_')?
            .strip_suffix(format.extension())?
            .strip_suffix('.')?;
        let is_number = digits.len() >= 6 && digits.bytes().all(|digit| digit.is_ascii_digit());
        if is_number { digits.parse().ok() } else { None }
    }
}

/// Removes a file if it is there.
pub(crate) fn file_remove(path: &Path) -> Result<(), WriteError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(WriteError::of(path)(error)),
        _ => Ok(()),
    }
}

/// Writes `text` into a file that is complete or as it was.
pub(crate) fn text_write(path: &Path, text: &str) -> Result<(), Failure> {
    let result = file_replace(path, |file| file.write_all(text.as_bytes()));
    Ok(result.map_err(WriteError::of(path))?)
}

/// A scene name as a file name: nothing in it leads to another folder.
fn file_name(scene_name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "-_. ".contains(c) { c } else { '-' };
    // A limit below those of file systems, with room for numbers and extensions.
    let name: String = scene_name.chars().take(60).map(plain).collect();
    let name = name.trim_matches(['.', ' ']);
    if name.is_empty() { "scene".into() } else { name.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_scenes_stay_in_their_folder() {
        for (scene, file) in [
            ("drape", "drape"),
            ("../../etc/passwd", "-..-etc-passwd"),
            ("..", "scene"),
            ("", "scene"),
            ("a/b\\c\0d", "a-b-c-d"),
        ] {
            assert_eq!(file_name(scene), file);
        }
    }

    #[test]
    fn only_outputs_of_later_frames_are_removed() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::new(Some(root.path()), "flag");
        let png = folder.sequence(FrameFormat::Png);
        fs::create_dir(&png).unwrap();
        let names = ["flag_000001.png", "flag_000002.png", "flag_2.png", "other_000002.png"];
        for name in names {
            fs::write(png.join(name), "").unwrap();
        }
        fs::write(root.path().join("flag.gif"), "").unwrap();
        fs::write(root.path().join("mine.gif"), "").unwrap();
        folder.outputs_remove(2).unwrap();
        let left: Vec<bool> = names.iter().map(|name| png.join(name).exists()).collect();
        assert_eq!(left, [true, false, true, true]);
        assert!(!root.path().join("flag.gif").exists());
        assert!(root.path().join("mine.gif").exists());
    }
}
