//! Screenshots and clips of what is seen.

use std::path::{Path, PathBuf};

use cloth::io::{ClipWriter, FrameFormat};
use image::RgbImage;

use crate::ViewerError;

/// A clip in the making.
pub(super) struct Recording {
    clip: ClipWriter,
    /// The last frame that is in it.
    frame: Option<u64>,
}

impl Recording {
    /// Begins a clip in `folder`.
    pub(super) fn begin(
        folder: &Path,
        name: &str,
        frames_per_second: f64,
    ) -> Result<Self, ViewerError> {
        let path = free_path(folder, name, "gif");
        Ok(Self { clip: ClipWriter::new(FrameFormat::Gif, &path, frames_per_second)?, frame: None })
    }

    /// Whether this frame is still to be added.
    pub(super) fn wants(&self, frame: u64) -> bool {
        self.frame != Some(frame)
    }

    /// Adds a frame.
    pub(super) fn push(&mut self, frame: u64, picture: &RgbImage) -> Result<(), ViewerError> {
        self.frame = Some(frame);
        Ok(self.clip.push(picture)?)
    }

    /// Number of pictures.
    pub(super) const fn len(&self) -> usize {
        self.clip.len()
    }

    /// Writes the clip beside the window, which would stand still meanwhile; `done` is told how it went.
    pub(super) fn finish(self, done: impl FnOnce(Result<PathBuf, ViewerError>) + Send + 'static) {
        std::thread::spawn(move || done(self.clip.finish().map_err(ViewerError::from)));
    }
}

/// Writes a picture into `folder`, and gives back its path.
pub(super) fn screenshot(
    folder: &Path,
    name: &str,
    picture: &RgbImage,
) -> Result<PathBuf, ViewerError> {
    let path = free_path(folder, name, "png");
    picture.save(&path).map_err(|error| ViewerError::Output {
        path: path.clone(),
        problem: error.to_string(),
        mend: "choose a folder that can be written with --out",
    })?;
    Ok(path)
}

/// The first name with a number that is not taken.
fn free_path(folder: &Path, name: &str, extension: &str) -> PathBuf {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '-' }).collect();
    let path = |number: usize| folder.join(format!("{plain}-{number:03}.{extension}"));
    (1..).map(path).find(|path| !path.exists()).unwrap_or_else(|| path(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_never_replaced_and_stay_in_their_folder() {
        let folder = tempfile::tempdir().unwrap();
        let picture = RgbImage::new(2, 2);
        let first = screenshot(folder.path(), "../a b", &picture).unwrap();
        let second = screenshot(folder.path(), "../a b", &picture).unwrap();
        assert_ne!(first, second);
        assert_eq!(second.parent(), Some(folder.path()));
    }
}
