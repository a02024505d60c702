//! Writes formats with one file per frame.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use image::codecs::png::PngEncoder;
use image::{ImageEncoder, RgbImage};

use super::animation::PictureAnimation;
use super::obj::obj_write;
use super::output::output_write;
use super::ply::ply_write;
use super::vtu::{VtuLayout, pvd_write, vtu_write};
use super::{Frame, FrameError, FrameFormat, FrameSolids, FrameStore, Topology};
use crate::picture::PictureStyle;

/// Makes the picture of a frame, or says why not.
pub type PictureMaker<'a> =
    Box<dyn FnMut(&Frame<'_>) -> Result<RgbImage, Box<dyn Error + Send + Sync>> + 'a>;

/// Writes each frame of a run into a file of its own, `name_000000.obj` and so on; [`FrameFormat::Vtu`]
/// also keeps a collection `name.pvd` of all frames up to date.
pub struct FrameSequenceWriter<'a> {
    format: FrameFormat,
    folder: PathBuf,
    name: String,
    topology: &'a Topology,
    /// Time of each frame of the collection \[s\].
    times: BTreeMap<u64, f64>,
    style: PictureStyle,
    pictures: Option<PictureAnimation<'a>>,
    maker: Option<PictureMaker<'a>>,
    solids: Option<FrameSolids>,
    /// The points of [`FrameFormat::Vtu`].
    layout: Option<VtuLayout>,
}

impl<'a> FrameSequenceWriter<'a> {
    /// Prepares to write frames in `format` into `folder`, which is created if it is missing.
    /// Existing files of the same frames are replaced.
    ///
    /// # Errors
    ///
    /// [`FrameError::Kind`] if the format holds all frames in one file, [`FrameError::Topology`],
    /// or [`FrameError::Write`] if the folder cannot be created.
    pub fn new(
        format: FrameFormat,
        folder: &Path,
        name: &str,
        topology: &'a Topology,
    ) -> Result<Self, FrameError> {
        if !format.is_sequence() {
            return Err(FrameError::Kind {
                format,
                is: "one file for all frames",
                instead: "container_write with a frame store",
            });
        }
        topology.check()?;
        std::fs::create_dir_all(folder).map_err(FrameError::write(folder))?;
        Ok(Self {
            format,
            folder: folder.to_owned(),
            name: name.to_owned(),
            topology,
            times: BTreeMap::new(),
            style: PictureStyle::default(),
            pictures: None,
            maker: None,
            solids: None,
            layout: (format == FrameFormat::Vtu).then(|| VtuLayout::of(topology)),
        })
    }

    /// Sets how [`FrameFormat::Png`] looks. Without a camera in the style, the first frame written
    /// decides the view, so a run that is to be resumed should give one.
    #[must_use]
    pub fn with_style(mut self, style: PictureStyle) -> Self {
        self.style = style;
        self
    }

    /// Sets what makes pictures in place of the renderer of this crate.
    #[must_use]
    pub fn with_maker(mut self, maker: PictureMaker<'a>) -> Self {
        self.maker = Some(maker);
        self
    }

    /// Sets the colliders and rigid bodies that [`FrameFormat::Obj`] and [`FrameFormat::Vtu`] are to show
    /// beside the cloth.
    #[must_use]
    pub fn with_solids(mut self, solids: Option<FrameSolids>) -> Self {
        self.solids = solids;
        self
    }

    /// Takes the frames of `store` that an earlier part of the same run wrote files of into the
    /// collection. The store has all frames, but that part may have left some out or written another
    /// format.
    ///
    /// # Errors
    ///
    /// [`FrameError::Read`].
    pub fn resume(mut self, store: &FrameStore) -> Result<Self, FrameError> {
        for index in 0..store.len() {
            if self.folder.join(self.file_name(index as u64)).exists() {
                self.times.insert(index as u64, store.time(index)?);
            }
        }
        Ok(self)
    }

    /// Writes one frame and returns its file.
    ///
    /// # Errors
    ///
    /// [`FrameError::ParticleCount`]; [`FrameError::Position`], [`FrameError::Vector`] and
    /// [`FrameError::Time`] for numbers that are not finite; [`FrameError::Write`] or
    /// [`FrameError::Picture`].
    pub fn write(&mut self, frame: &Frame<'_>) -> Result<PathBuf, FrameError> {
        frame.check(self.topology.particle_count)?;
        let path = self.folder.join(self.file_name(frame.index));
        let topology = self.topology;
        let solids =
            || self.solids.as_ref().map(|solids| solids.at(frame.time)).unwrap_or_default();
        match self.format {
            FrameFormat::Obj => output_write(&path, |writer| {
                obj_write(writer, topology, frame, &solids()).map_err(FrameError::write(&path))
            })?,
            FrameFormat::Ply => output_write(&path, |writer| {
                ply_write(writer, topology, frame).map_err(FrameError::write(&path))
            })?,
            FrameFormat::Png => self.picture(&path, frame)?,
            _ => {
                let layout = self.layout.get_or_insert_with(|| VtuLayout::of(topology));
                let solids = solids();
                output_write(&path, |writer| {
                    let written = vtu_write(writer, topology, layout, frame, &solids);
                    written.map_err(FrameError::write(&path))
                })?;
                self.times.insert(frame.index, frame.time);
                self.collection()?;
            }
        }
        Ok(path)
    }

    fn file_name(&self, index: u64) -> String {
        self.format.file_name(&self.name, index)
    }

    fn collection(&self) -> Result<(), FrameError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        let names: Vec<_> = self.times.keys().map(|&index| self.file_name(index)).collect();
        let frames = self.times.values().copied();
        let frames = frames.zip(names.iter().map(String::as_str));
        output_write(&path, |writer| pvd_write(writer, frames).map_err(FrameError::write(&path)))
    }

    fn picture(&mut self, path: &Path, frame: &Frame<'_>) -> Result<(), FrameError> {
        let image = match (&mut self.maker, &mut self.pictures) {
            (Some(maker), _) => maker(frame).map_err(FrameError::write(path))?,
            (None, Some(pictures)) => pictures.render(frame.time, frame.positions)?,
            (None, empty) => {
                let first = [(frame.time, frame.positions)];
                let style = self.style.clone();
                empty
                    .insert(PictureAnimation::new(self.topology, style, first)?)
                    .render(frame.time, frame.positions)?
            }
        };
        output_write(path, |writer| {
            let (width, height) = image.dimensions();
            PngEncoder::new(writer)
                .write_image(&image, width, height, image::ExtendedColorType::Rgb8)
                .map_err(FrameError::write(path))
        })
    }
}
