//! Where a run keeps what: one folder, from which it can be resumed and converted.

mod changes;
mod choice;
mod meshes;
mod record;

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use cloth::{
    io::{FrameFormat, file_read, file_replace, output_check, parts_remove},
    scene::{CompileOptions, Scene},
};

use crate::failure::{Failure, WriteError};

pub(crate) use changes::is_same_file;
pub(crate) use record::RunSettings;

/// How the name of a folder of pictures begins that are drawn to make clips of.
pub(crate) const DRAWN_PREFIX: &str = ".cloth-";
/// How it ends.
pub(crate) const DRAWN_SUFFIX: &str = ".drawn";

/// The folder of a run.
#[derive(Clone, Debug)]
pub(crate) struct RunFolder {
    pub(crate) root: PathBuf,
    /// Start of the names of all outputs.
    name: String,
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

    /// The scene as it was run, with all its values.
    pub(crate) fn scene(&self) -> PathBuf {
        self.root.join("scene.toml")
    }

    /// Files of a run that are there whatever its formats are.
    fn own_files(&self) -> [PathBuf; 6] {
        let record = self.root.join(record::FILE);
        [self.store(), self.checkpoint(), self.report(), self.poses(), self.scene(), record]
    }

    /// The mesh that point caches move.
    fn cache_mesh(&self) -> PathBuf {
        self.root.join(format!("{}_mesh.obj", self.name))
    }

    /// Writes the scene as it is run, values of the command line included.
    pub(crate) fn scene_write(
        &self,
        scene: &Scene,
        options: &CompileOptions,
    ) -> Result<(), Failure> {
        let (text, files) = meshes::rewritten(scene, options)?;
        meshes::copy(&files, &self.root)?;
        text_write(&self.scene(), &text)
    }

    /// The scene that was run into the folder `root`. It may read what lies in this folder, and in `roots`.
    pub(crate) fn scene_read(
        root: &Path,
        roots: &[PathBuf],
    ) -> Result<(Scene, CompileOptions), Failure> {
        let path = root.join("scene.toml");
        for file in ["scene.toml", "frames.bin"] {
            fs::metadata(root.join(file)).map_err(|error| {
                let problem = format!("`{file}` cannot be read: {error}");
                Failure::input(FolderError { folder: root.to_owned(), problem })
            })?;
        }
        let scene = Scene::read(&path)?;
        let options = CompileOptions {
            mesh_roots: roots.to_vec(),
            memory_limit: u64::MAX,
            ..CompileOptions::default()
        };
        Ok((scene, options))
    }

    /// Removes what runs that ended in the midst of it left half written. Nobody else writes in the folder.
    pub(crate) fn leftovers_remove(&self) -> Result<(), WriteError> {
        let sequences = FrameFormat::ALL.into_iter().filter(|format| format.is_sequence());
        let folders = sequences.map(|format| self.sequence(format));
        for folder in folders.chain([self.root.clone()]) {
            parts_remove(&folder).map_err(WriteError::of(&folder))?;
        }
        let entries = fs::read_dir(&self.root).map_err(WriteError::of(&self.root))?;
        for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let is_ours = name.starts_with(DRAWN_PREFIX) && name.ends_with(DRAWN_SUFFIX);
            if is_ours && fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_dir()) {
                fs::remove_dir_all(&path).map_err(WriteError::of(&path))?;
            }
        }
        Ok(())
    }

    /// Checks that nothing that this run will write is a device, a pipe or a link out of the folder.
    pub(crate) fn outputs_check(&self, formats: &[FrameFormat]) -> Result<(), WriteError> {
        let (sequences, containers): (Vec<FrameFormat>, Vec<FrameFormat>) =
            formats.iter().partition(|format| format.is_sequence());
        let containers = containers.into_iter().map(|format| self.container(format));
        for path in self.own_files().into_iter().chain(containers) {
            output_check(&path).map_err(WriteError::of(&path))?;
        }
        for path in sequences.into_iter().map(|format| self.sequence(format)) {
            let is_link = fs::symlink_metadata(&path).is_ok_and(|metadata| metadata.is_symlink());
            let leads_out = || {
                let [at, root] = [&path, &self.root].map(fs::canonicalize);
                !matches!((at, root), (Ok(at), Ok(root)) if at.starts_with(&root))
            };
            if is_link && leads_out() {
                let problem = "it is a symbolic link that leads out of the folder of the run";
                let error = io::Error::new(io::ErrorKind::InvalidInput, problem);
                return Err(WriteError::of(&path)(error));
            }
        }
        Ok(())
    }

    /// Removes what an earlier run wrote, for a run that replaces it. Names that no run writes are left alone.
    pub(crate) fn outputs_remove(&self) -> Result<(), WriteError> {
        self.frames_remove(0)?;
        for format in FrameFormat::ALL.into_iter().filter(|format| !format.is_sequence()) {
            file_remove(&self.container(format))?;
        }
        let collection = format!("{}.pvd", self.name);
        file_remove(&self.sequence(FrameFormat::Vtu).join(collection))?;
        file_remove(&self.cache_mesh())?;
        meshes::remove(&self.root)
    }

    /// Removes the files of frame `from` and later ones, which are to be made again.
    pub(crate) fn frames_remove(&self, from: u64) -> Result<(), WriteError> {
        let sequences = FrameFormat::ALL.into_iter().filter(|format| format.is_sequence());
        sequences.into_iter().try_for_each(|format| self.sequence_remove(format, from))
    }

    fn sequence_remove(&self, format: FrameFormat, from: u64) -> Result<(), WriteError> {
        let files = self.sequence_files(format);
        let mut late = files.filter(|path| self.frame_of(path, format) >= Some(from));
        late.try_for_each(|path| file_remove(&path))
    }

    /// The frames of a sequence that are there.
    fn sequence_files(&self, format: FrameFormat) -> impl Iterator<Item = PathBuf> {
        // No folder, no files.
        let entries = fs::read_dir(self.sequence(format)).into_iter().flatten();
        let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
        paths.filter(move |path| self.frame_of(path, format).is_some())
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

/// The text of a file in the folder of a run; nothing is read of what is no file, or longer than any scene.
fn text_read(path: &Path) -> io::Result<String> {
    /// Bytes.
    const MOST: u64 = 1 << 28;
    let bytes = file_read(path, MOST)?;
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
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
        folder.frames_remove(2).unwrap();
        let left: Vec<bool> = names.iter().map(|name| png.join(name).exists()).collect();
        assert_eq!(left, [true, false, true, true]);
        assert!(
            root.path().join("flag.gif").exists(),
            "it is replaced when the new one is complete"
        );
        folder.outputs_remove().unwrap();
        assert!(!root.path().join("flag.gif").exists() && !png.join(names[0]).exists());
        assert!(root.path().join("mine.gif").exists());
    }
}
