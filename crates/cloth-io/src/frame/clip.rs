//! Pictures from elsewhere as one animated file.

use std::path::{Path, PathBuf};

use image::RgbImage;
use tempfile::TempDir;

use super::{FrameError, FrameFormat, apng, gif};

/// Collects pictures of any renderer and makes one animated file of them. They wait on the disk, so
/// that a clip of any length needs little memory.
#[derive(Debug)]
pub struct ClipWriter {
    format: FrameFormat,
    path: PathBuf,
    frames_per_second: f64,
    folder: TempDir,
    size: Option<[u32; 2]>,
    count: usize,
}

impl ClipWriter {
    /// Begins a clip that [`Self::finish`] will write to `path`.
    ///
    /// # Errors
    /// [`FrameError::Kind`] unless `format` is [`FrameFormat::Gif`] or [`FrameFormat::Apng`];
    /// [`FrameError::Write`] if there is no room for temporary files.
    pub fn new(
        format: FrameFormat,
        path: &Path,
        frames_per_second: f64,
    ) -> Result<Self, FrameError> {
        if !matches!(format, FrameFormat::Gif | FrameFormat::Apng) {
            return Err(FrameError::Kind {
                format,
                is: "no format of clips",
                instead: "gif or apng",
            });
        }
        let folder = tempfile::tempdir().map_err(FrameError::write(&std::env::temp_dir()))?;
        let path = path.to_owned();
        Ok(Self { format, path, frames_per_second, folder, size: None, count: 0 })
    }

    /// Adds a picture; those of another size than the first are scaled to it.
    ///
    /// # Errors
    /// [`FrameError::Write`].
    pub fn push(&mut self, picture: &RgbImage) -> Result<(), FrameError> {
        let [width, height] = *self.size.get_or_insert(picture.dimensions().into());
        let file = self.file(self.count);
        let written = if picture.dimensions() == (width, height) {
            picture.save(&file)
        } else {
            let filter = image::imageops::FilterType::Triangle;
            image::imageops::resize(picture, width, height, filter).save(&file)
        };
        written.map_err(FrameError::write(&file))?;
        self.count += 1;
        Ok(())
    }

    /// Number of pictures so far.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no picture yet.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Writes the file, and gives back its path.
    ///
    /// # Errors
    /// [`FrameError::Write`], [`FrameError::Size`], and [`FrameError::FrameNone`] for a clip without
    /// pictures.
    pub fn finish(self) -> Result<PathBuf, FrameError> {
        let Some(size) = self.size else { return Err(FrameError::FrameNone { file: self.path }) };
        let picture = |number: usize| {
            let file = self.file(number);
            let image = image::open(&file).map_err(|error| FrameError::Read {
                file: file.clone(),
                source: std::io::Error::other(error),
            })?;
            Ok(image.into_rgb8())
        };
        let (path, rate, count) = (&self.path, self.frames_per_second, self.count);
        match self.format {
            FrameFormat::Gif => gif::write_pictures(path, size, rate, count, picture)?,
            _ => apng::write_pictures(path, size, rate, count, picture)?,
        }
        Ok(self.path)
    }

    fn file(&self, number: usize) -> PathBuf {
        self.folder.path().join(format!("{number}.png"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clip_holds_its_pictures() {
        let folder = tempfile::tempdir().unwrap();
        for (format, name) in [(FrameFormat::Gif, "clip.gif"), (FrameFormat::Apng, "clip.png")] {
            let mut clip = ClipWriter::new(format, &folder.path().join(name), 25.0).unwrap();
            for shade in [10_u8, 120, 250] {
                clip.push(&RgbImage::from_pixel(8, 6, image::Rgb([shade, 20, 30]))).unwrap();
            }
            clip.push(&RgbImage::new(16, 12)).unwrap();
            assert_eq!(clip.len(), 4);
            let bytes = std::fs::read(clip.finish().unwrap()).unwrap();
            let frames = match format {
                FrameFormat::Gif => {
                    let mut reader = ::gif::DecodeOptions::new().read_info(&bytes[..]).unwrap();
                    let mut count = 0;
                    while reader.read_next_frame().unwrap().is_some() {
                        count += 1;
                    }
                    assert_eq!((reader.width(), reader.height()), (8, 6));
                    count
                }
                _ => {
                    let reader = png::Decoder::new(std::io::Cursor::new(&bytes));
                    let reader = reader.read_info().unwrap();
                    assert_eq!((reader.info().width, reader.info().height), (8, 6));
                    reader.info().animation_control().unwrap().num_frames
                }
            };
            assert_eq!(frames, 4);
        }
    }

    #[test]
    fn other_formats_and_empty_clips_are_refused() {
        let path = Path::new("clip.obj");
        let outcome = ClipWriter::new(FrameFormat::Obj, path, 25.0);
        assert!(matches!(outcome, Err(FrameError::Kind { .. })));
        let empty = ClipWriter::new(FrameFormat::Gif, Path::new("clip.gif"), 25.0).unwrap();
        assert!(matches!(empty.finish(), Err(FrameError::FrameNone { .. })));
    }
}
