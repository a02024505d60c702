//! Screenshots and clips of what is seen.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{SyncSender, sync_channel},
    thread::JoinHandle,
};

use image::RgbImage;

use crate::{ClipFormat, ViewerError, clip::Clip};

/// Pictures that may wait for their encoder. When more come the window waits, too: better slow than
/// out of memory.
const WAITING: usize = 30;

/// A clip in the making, which is encoded beside the window.
pub(super) struct Recording {
    /// Without it the clip ends.
    pictures: SyncSender<RgbImage>,
    writer: JoinHandle<()>,
    /// The last frame that is in it.
    frame: Option<u64>,
    count: usize,
}

impl Recording {
    /// Begins a clip in `folder`; `done` is told how it went, after [`Self::end`] or when
    /// something goes wrong.
    pub(super) fn begin(
        folder: &Path,
        name: &str,
        format: ClipFormat,
        frames_per_second: f64,
        done: impl FnOnce(Result<PathBuf, ViewerError>) + Send + 'static,
    ) -> Result<Self, ViewerError> {
        let path = free_path(folder, name, format.extension());
        let mut clip = Clip::new(format, &path, frames_per_second)?;
        let (pictures, receiver) = sync_channel::<RgbImage>(WAITING);
        let writer = std::thread::spawn(move || {
            let pushed = receiver.iter().try_for_each(|picture| clip.push(&picture));
            done(pushed.and_then(|()| clip.finish()));
        });
        Ok(Self { pictures, writer, frame: None, count: 0 })
    }

    /// Whether this frame is still to be added.
    pub(super) fn wants(&self, frame: u64) -> bool {
        self.frame != Some(frame)
    }

    /// Adds a frame.
    pub(super) fn push(&mut self, frame: u64, picture: RgbImage) {
        self.frame = Some(frame);
        self.count += 1;
        // Whoever takes them ends early by an error, which it reports.
        let _ = self.pictures.send(picture);
    }

    /// No more pictures; gives back the thread that writes the rest of the clip.
    pub(super) fn end(self) -> JoinHandle<()> {
        drop(self.pictures);
        self.writer
    }

    /// Number of pictures.
    pub(super) const fn len(&self) -> usize {
        self.count
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
pub(super) fn free_path(folder: &Path, name: &str, extension: &str) -> PathBuf {
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

    #[test]
    fn a_recording_is_written_when_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        for format in ClipFormat::ALL {
            let (sender, receiver) = std::sync::mpsc::channel();
            let done = move |outcome| sender.send(outcome).unwrap();
            let mut recording =
                Recording::begin(folder.path(), "sheet", format, 30.0, done).unwrap();
            for frame in 0..3 {
                assert!(recording.wants(frame));
                recording.push(frame, RgbImage::from_pixel(32, 20, image::Rgb([90; 3])));
                assert!(!recording.wants(frame));
            }
            assert_eq!(recording.len(), 3);
            recording.end().join().unwrap();
            let path = receiver.recv().unwrap().unwrap();
            assert_eq!(path.extension().unwrap(), format.extension());
            assert!(std::fs::metadata(path).unwrap().len() > 60);
        }
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        let (sender, receiver) = std::sync::mpsc::channel();
        let done = move |outcome| sender.send(outcome).unwrap();
        let folder = Path::new("/nonexistent/folder");
        let mut recording = Recording::begin(folder, "sheet", ClipFormat::Mp4, 30.0, done).unwrap();
        recording.push(0, RgbImage::new(32, 32));
        recording.end().join().unwrap();
        assert!(receiver.recv().unwrap().is_err());
    }
}
