//! The file of one frame in a format with one file per frame.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageEncoder, RgbImage};

use super::obj::obj_write;
use super::output::output_write;
use super::ply::ply_write;
use super::vtu::{VtuLayout, pvd_write, vtu_write};
use super::{Frame, FrameError, FrameFormat, FrameSolids, Topology};

/// Where the files of a format are and what they are called.
#[derive(Clone, Debug)]
pub(super) struct SequenceFiles {
    pub(super) format: FrameFormat,
    pub(super) folder: PathBuf,
    pub(super) name: String,
    /// What formats that can show beside the cloth.
    pub(super) solids: Option<FrameSolids>,
    /// The points of [`FrameFormat::Vtu`].
    layout: Option<Arc<VtuLayout>>,
}

impl SequenceFiles {
    /// Files of frames of `topology` in `folder`, which is created if it is missing.
    pub(super) fn new(
        format: FrameFormat,
        folder: &Path,
        name: &str,
        topology: &Topology,
    ) -> Result<Self, FrameError> {
        if !format.is_sequence() {
            return Err(FrameError::Kind {
                format,
                is: "one file for all frames",
                instead: "container_write with a frame store",
            });
        }
        std::fs::create_dir_all(folder).map_err(FrameError::write(folder))?;
        let layout = (format == FrameFormat::Vtu).then(|| Arc::new(VtuLayout::of(topology)));
        let (folder, name) = (folder.to_owned(), name.to_owned());
        Ok(Self { format, folder, name, solids: None, layout })
    }

    /// The file of frame `index`.
    pub(super) fn path(&self, index: u64) -> PathBuf {
        self.folder.join(self.file_name(index))
    }

    fn file_name(&self, index: u64) -> String {
        self.format.file_name(&self.name, index)
    }

    /// Writes the file of a frame in a format of geometry, and gives back its path.
    pub(super) fn write(
        &self,
        topology: &Topology,
        frame: &Frame<'_>,
    ) -> Result<PathBuf, FrameError> {
        let path = self.path(frame.index);
        let error = || FrameError::write(&path);
        let solids = self.solids.as_ref().map(|solids| solids.at(frame.time)).unwrap_or_default();
        output_write(&path, |writer| match (&self.layout, self.format) {
            (Some(layout), _) => {
                vtu_write(writer, topology, layout, frame, &solids).map_err(error())
            }
            (None, FrameFormat::Obj) => {
                obj_write(writer, topology, frame, &solids).map_err(error())
            }
            (None, _) => ply_write(writer, topology, frame).map_err(error()),
        })?;
        Ok(path)
    }

    /// Writes the picture of frame `index`, and gives back its path.
    pub(super) fn picture_write(
        &self,
        index: u64,
        image: &RgbImage,
    ) -> Result<PathBuf, FrameError> {
        let path = self.path(index);
        output_write(&path, |writer| {
            let (width, height) = image.dimensions();
            // One filter for all rows: to try all takes thrice the time, and pictures of cloth on a floor become as small
            // with this one.
            PngEncoder::new_with_quality(writer, CompressionType::Fast, FilterType::Sub)
                .write_image(image, width, height, image::ExtendedColorType::Rgb8)
                .map_err(FrameError::write(&path))
        })?;
        Ok(path)
    }

    /// Writes the collection of all frames, with their numbers and times \[s\], in their order.
    pub(super) fn collection_write<'t>(
        &self,
        times: impl Iterator<Item = (&'t u64, &'t f64)>,
    ) -> Result<(), FrameError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        let frames: Vec<_> = times.map(|(&index, &time)| (time, self.file_name(index))).collect();
        let frames = frames.iter().map(|(time, name)| (*time, name.as_str()));
        output_write(&path, |writer| pvd_write(writer, frames).map_err(FrameError::write(&path)))
    }
}
