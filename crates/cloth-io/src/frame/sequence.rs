//! Writes formats with one file per frame.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};

use image::RgbImage;

use super::animation::PictureAnimation;
use super::sequence_file::SequenceFiles;
use super::{Frame, FrameError, FrameFormat, FrameSolids, FrameStore, Topology};
use crate::picture::PictureStyle;

/// Makes the picture of a frame, or says why not.
pub type PictureMaker<'a> =
    Box<dyn FnMut(&Frame<'_>) -> Result<RgbImage, Box<dyn Error + Send + Sync>> + 'a>;

/// Writes each frame of a run into a file of its own, `name_000000.obj` and so on; [`FrameFormat::Vtu`]
/// also keeps a collection `name.pvd` of all frames up to date. A [`FramePipeline`](super::FramePipeline)
/// does the same while the caller computes the next frame.
pub struct FrameSequenceWriter<'a> {
    files: SequenceFiles,
    topology: &'a Topology,
    /// Time of each frame of the collection \[s\].
    times: BTreeMap<u64, f64>,
    style: PictureStyle,
    pictures: Option<PictureAnimation>,
    maker: Option<PictureMaker<'a>>,
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
        topology.check()?;
        Ok(Self {
            files: SequenceFiles::new(format, folder, name, topology)?,
            topology,
            times: BTreeMap::new(),
            style: PictureStyle::default(),
            pictures: None,
            maker: None,
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
        self.files.solids = solids;
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
        self.times = earlier_times(&self.files, store)?;
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
        if self.files.format == FrameFormat::Png {
            if let Some(maker) = &mut self.maker {
                let path = self.files.path(frame.index);
                let image = maker(frame).map_err(FrameError::write(&path))?;
                return self.files.picture_write(frame.index, &image);
            }
            let pictures = match &mut self.pictures {
                Some(pictures) => pictures,
                empty => {
                    let first = [(frame.time, frame.positions)];
                    empty.insert(PictureAnimation::new(self.style.clone(), first)?)
                }
            };
            let image = pictures.render(self.topology, frame.time, frame.positions)?;
            return self.files.picture_write(frame.index, &image);
        }
        let path = self.files.write(self.topology, frame)?;
        if self.files.format == FrameFormat::Vtu {
            self.times.insert(frame.index, frame.time);
            self.files.collection_write(self.times.iter())?;
        }
        Ok(path)
    }
}

/// Times \[s\] of the frames of `store` of which there are `files`.
pub(super) fn earlier_times(
    files: &SequenceFiles,
    store: &FrameStore,
) -> Result<BTreeMap<u64, f64>, FrameError> {
    let mut times = BTreeMap::new();
    for index in 0..store.len() {
        if files.path(index as u64).exists() {
            times.insert(index as u64, store.time(index)?);
        }
    }
    Ok(times)
}
