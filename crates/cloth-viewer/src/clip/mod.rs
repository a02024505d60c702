//! Animated files of pictures.

mod movie;

use std::path::{Path, PathBuf};

use cloth::io::{ClipWriter, FrameFormat};
use image::RgbImage;

use crate::ViewerError;
use movie::MovieWriter;

/// A format of clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ClipFormat {
    /// Animated GIF.
    Gif,
    /// Animated PNG.
    Apng,
    /// AV1 in MP4.
    #[default]
    Mp4,
}

impl ClipFormat {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Gif, Self::Apng, Self::Mp4];

    /// Extension of its files, without the dot.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Gif => "gif",
            Self::Apng => "png",
            Self::Mp4 => "mp4",
        }
    }

    /// The format that the extension of a file asks for.
    ///
    /// # Errors
    /// [`ViewerError::Output`] with what can be written.
    pub fn of_path(path: &Path) -> Result<Self, ViewerError> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "gif" => Ok(Self::Gif),
            "png" | "apng" => Ok(Self::Apng),
            "mp4" => Ok(Self::Mp4),
            _ => Err(ViewerError::Output {
                path: path.to_owned(),
                problem: "its extension is none of mp4, gif, png".into(),
                mend: "name it clip.mp4, clip.gif or clip.png",
            }),
        }
    }
}

/// A clip in the making, in any format.
pub(crate) enum Clip {
    /// Begun with the first picture, which says the size.
    Movie {
        path: PathBuf,
        frames_per_second: f64,
        writer: Option<Box<MovieWriter>>,
    },
    Pictures(ClipWriter),
}

impl Clip {
    /// Begins a clip that [`Self::finish`] will write to `path`.
    ///
    /// # Errors
    /// [`ViewerError::Frames`] if there is no room for temporary files.
    pub(crate) fn new(
        format: ClipFormat,
        path: &Path,
        frames_per_second: f64,
    ) -> Result<Self, ViewerError> {
        let format = match format {
            ClipFormat::Gif => FrameFormat::Gif,
            ClipFormat::Apng => FrameFormat::Apng,
            ClipFormat::Mp4 => {
                let path = path.to_owned();
                return Ok(Self::Movie { path, frames_per_second, writer: None });
            }
        };
        Ok(Self::Pictures(ClipWriter::new(format, path, frames_per_second)?))
    }

    /// Adds a picture; those of another size than the first are scaled to it.
    ///
    /// # Errors
    /// What is wrong with the size, the encoder or the disk.
    pub(crate) fn push(&mut self, picture: &RgbImage) -> Result<(), ViewerError> {
        match self {
            Self::Pictures(writer) => Ok(writer.push(picture)?),
            Self::Movie { path, frames_per_second, writer } => {
                let writer = match writer {
                    Some(writer) => writer,
                    empty => {
                        let size = picture.dimensions().into();
                        empty.insert(Box::new(MovieWriter::new(path, size, *frames_per_second)?))
                    }
                };
                writer.push(picture)
            }
        }
    }

    /// Writes the file, and gives back its path.
    ///
    /// # Errors
    /// What the disk reports; a clip without pictures.
    pub(crate) fn finish(self) -> Result<PathBuf, ViewerError> {
        match self {
            Self::Pictures(writer) => Ok(writer.finish()?),
            Self::Movie { writer: Some(writer), .. } => writer.finish(),
            Self::Movie { path, writer: None, .. } => Err(ViewerError::Output {
                path,
                problem: "it has no pictures".into(),
                mend: "record for at least one frame",
            }),
        }
    }
}
