//! Which folder a run goes to: never one in which it would replace something, unless it is told to.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use cloth::io::FrameFormat;

use super::{RunFolder, is_same_file};
use crate::failure::{Failure, WriteError};

/// A folder that has a run.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` has files that this run would replace (`{}`); add --resume to go on with the run that wrote them, --overwrite to replace it, \
     or choose another folder with --out",
    folder.display(), found.display()
)]
struct Occupied {
    folder: PathBuf,
    found: PathBuf,
}

/// A folder that has the scene of the run.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` has the scene itself, which is never written over; choose another folder with --out, or add --resume to go on with the run that \
     wrote it",
    folder.display()
)]
struct OwnScene {
    folder: PathBuf,
}

impl RunFolder {
    /// Refuses a folder that was asked for and has a run.
    pub(crate) fn check_free(&self) -> Result<(), Failure> {
        match self.occupied_by() {
            Some(found) => Err(Failure::input(Occupied { folder: self.root.clone(), found })),
            None => Ok(()),
        }
    }

    /// Refuses a folder in which the run would write over its own scene.
    pub(crate) fn check_apart(&self, scene: &Path) -> Result<(), Failure> {
        if is_same_file(scene, &self.scene()) {
            return Err(Failure::input(OwnScene { folder: self.root.clone() }));
        }
        Ok(())
    }

    /// Makes the folder for a run that nobody chose one for: this one, or if it has a run the first free one of those with a number
    /// at the end of the name. Returns it with the one that is kept.
    pub(crate) fn create_free(self) -> Result<(Self, Option<PathBuf>), Failure> {
        let first = self.root.clone();
        for number in 1_u32.. {
            let folder = Self { root: numbered(&first, number), name: self.name.clone() };
            if let Some(parent) = folder.root.parent() {
                fs::create_dir_all(parent).map_err(WriteError::of(parent))?;
            }
            match fs::create_dir(&folder.root) {
                // Whoever makes a folder has it for itself.
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                    if folder.occupied_by().is_some() || !folder.root.is_dir() {
                        continue;
                    }
                }
                Err(error) => return Err(WriteError::of(&folder.root)(error).into()),
            }
            let kept = (number > 1).then_some(first);
            return Ok((folder, kept));
        }
        Ok((self, None))
    }

    /// The latest run in this folder or those with a number at the end of the name, or this one.
    pub(crate) fn latest(self) -> Self {
        let folder = |number| Self { root: numbered(&self.root, number), name: self.name.clone() };
        // Numbers have no gaps unless somebody removed a folder; one is no reason to stop.
        let there = (1_u32..10_000).map(folder).take_while(|folder| folder.root.exists());
        there.filter(|folder| folder.checkpoint().exists()).last().unwrap_or(self)
    }

    /// A file of a run in the folder, if there is one.
    fn occupied_by(&self) -> Option<PathBuf> {
        let containers = FrameFormat::ALL.into_iter().filter(|format| !format.is_sequence());
        let containers = containers.map(|format| self.container(format));
        let files = self.own_files().into_iter().chain(containers).chain([self.cache_mesh()]);
        // A link that leads nowhere is there, too.
        let mut files = files.filter(|path| fs::symlink_metadata(path).is_ok());
        let sequences = FrameFormat::ALL.into_iter().filter(|format| format.is_sequence());
        files
            .next()
            .or_else(|| sequences.into_iter().find_map(|format| self.sequence_files(format).next()))
    }
}

/// `out/drape`, `out/drape-2` and so on.
fn numbered(first: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return first.to_owned();
    }
    let mut name = first.file_name().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    first.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_get_folders_of_their_own() {
        let root = tempfile::tempdir().unwrap();
        let folder = || RunFolder { root: root.path().join("out/flag"), name: "flag".into() };
        let create = || folder().create_free().unwrap();
        let (first, kept) = create();
        assert_eq!((first.root, kept), (root.path().join("out/flag"), None));
        // Without a run in it it is still free.
        assert_eq!(create().1, None);
        fs::write(root.path().join("out/flag/flag.gif"), "").unwrap();
        let (second, kept) = create();
        assert_eq!((second.root, kept), (root.path().join("out/flag-2"), Some(folder().root)));
        fs::create_dir(root.path().join("out/flag-2/png")).unwrap();
        fs::write(root.path().join("out/flag-2/png/flag_000003.png"), "").unwrap();
        fs::write(root.path().join("out/flag-3"), "a file").unwrap();
        assert_eq!(create().0.root, root.path().join("out/flag-4"));
        assert_eq!(folder().latest().root, folder().root, "no checkpoint");
        fs::write(root.path().join("out/flag-2/checkpoint.bin"), "").unwrap();
        assert_eq!(folder().latest().root, root.path().join("out/flag-2"));
        let message = folder().check_free().unwrap_err().sentence();
        assert!(message.contains("flag.gif") && message.contains("--overwrite"), "{message}");
    }
}
