//! Writes the frames of a run while the next ones are computed.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use image::RgbImage;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::animation::{PictureAnimation, batch_limit, scaled};
use super::container::PictureSequence;
use super::sequence::earlier_times;
use super::sequence_file::SequenceFiles;
use super::{Frame, FrameError, FrameFormat, FrameSolids, FrameStore, Topology};
use crate::picture::{PictureError, PictureStyle};

/// Writes frames in formats with one file per frame, and draws their pictures, on threads of its
/// own. [`FramePipeline::write`] takes a copy of a frame and returns at once; it waits only if more
/// frames than threads are under way, so that the memory of a long run stays bounded. What is in the
/// files does not depend on the number of threads.
///
/// An error of a frame comes back from a later [`FramePipeline::write`] or from
/// [`FramePipeline::finish`], that of the earliest frame first.
#[derive(Debug)]
pub struct FramePipeline {
    work: Arc<Work>,
    pool: ThreadPool,
    sender: Sender<(u64, Outcome)>,
    receiver: Receiver<(u64, Outcome)>,
    /// Frames handed over so far.
    taken: u64,
    /// Outcomes that have come back, of which the first `reported` have been looked at.
    outcomes: BTreeMap<u64, Outcome>,
    reported: u64,
    /// Most frames under way at the same time.
    limit: u64,
    /// Frames of each collection with their times \[s\].
    collections: Vec<(SequenceFiles, BTreeMap<u64, f64>)>,
}

/// Number and time \[s\] of a frame whose files are written.
type Outcome = Result<(u64, f64), FrameError>;

/// What the threads need.
#[derive(Clone, Debug)]
struct Work {
    topology: Arc<Topology>,
    /// Formats of geometry.
    files: Vec<SequenceFiles>,
    /// Pictures, each with its size \[pixel\].
    pictures: Vec<(SequenceFiles, [u32; 2])>,
    renderer: Option<Arc<PictureAnimation>>,
}

/// A frame that a thread owns.
struct OwnedFrame {
    index: u64,
    time: f64,
    positions: Vec<[f64; 3]>,
    velocities: Option<Vec<[f64; 3]>>,
    normals: Option<Vec<[f64; 3]>>,
    picture: Option<RgbImage>,
}

impl FramePipeline {
    /// A pipeline that writes nothing yet, with that many threads, or as many as the machine has.
    ///
    /// # Errors
    ///
    /// [`FrameError::Topology`], or [`FrameError::Threads`] if the system gives no threads.
    pub fn new(topology: &Topology, threads: Option<NonZeroUsize>) -> Result<Self, FrameError> {
        topology.check()?;
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads.map_or(0, NonZeroUsize::get))
            .thread_name(|number| format!("frames {number}"))
            .build()
            .map_err(|source| FrameError::Threads { source })?;
        let (sender, receiver) = channel();
        let work = Work {
            topology: Arc::new(topology.clone()),
            files: Vec::new(),
            pictures: Vec::new(),
            renderer: None,
        };
        // As many that wait as are being worked on.
        let limit = 2 * pool.current_num_threads() as u64;
        Ok(Self {
            work: Arc::new(work),
            pool,
            sender,
            receiver,
            taken: 0,
            outcomes: BTreeMap::new(),
            reported: 0,
            limit,
            collections: Vec::new(),
        })
    }

    /// Adds a format of geometry, whose files go into `folder`, which is created if it is missing.
    /// Existing files of the same frames are replaced; frames of `store` that an earlier part of the
    /// same run wrote files of stay in the collection of [`FrameFormat::Vtu`].
    ///
    /// # Errors
    ///
    /// [`FrameError::Kind`] if the format is not one of geometry with one file per frame,
    /// [`FrameError::Read`], or [`FrameError::Write`] if the folder cannot be created.
    pub fn add_geometry(
        &mut self,
        format: FrameFormat,
        folder: &Path,
        name: &str,
        store: &FrameStore,
    ) -> Result<(), FrameError> {
        if format.is_picture() {
            return Err(FrameError::Kind {
                format,
                is: "a format of pictures",
                instead: "FramePipeline::add_pictures",
            });
        }
        let files = SequenceFiles::new(format, folder, name, &self.work.topology)?;
        if format == FrameFormat::Vtu {
            let times = earlier_times(&files, store)?;
            self.collections.push((files.clone(), times));
        }
        Arc::make_mut(&mut self.work).files.push(files);
        Ok(())
    }

    /// Adds pictures in the look of `style`, as PNG files that are called and lie as `sequence` says;
    /// the folder is created if it is missing. With several sizes the largest is drawn, and the
    /// others are made of it; all must have the same shape and look.
    ///
    /// # Errors
    ///
    /// [`FrameError::Write`] if the folder cannot be created, or [`FrameError::Picture`]; a style
    /// without a camera is refused, as each frame alone could not tell what to show.
    pub fn add_pictures(
        &mut self,
        sequence: &PictureSequence,
        style: &PictureStyle,
    ) -> Result<(), FrameError> {
        let files = SequenceFiles::new(
            FrameFormat::Png,
            &sequence.folder,
            &sequence.name,
            &self.work.topology,
        )?;
        let size = [style.width, style.height];
        if style.camera.is_none() {
            let problem = "there is none, and a frame alone does not tell what to show";
            return Err(PictureError::Camera { problem }.into());
        }
        let pictures = PictureAnimation::new(style.clone(), [])?;
        let work = Arc::make_mut(&mut self.work);
        work.pictures.push((files, size));
        // The largest first.
        work.pictures.sort_by_key(|(_, [width, _])| std::cmp::Reverse(*width));
        if work.pictures[0].1 == size {
            work.renderer = Some(Arc::new(pictures));
        }
        self.limit = self.limit.min(batch_limit(work.pictures[0].1) as u64).max(1);
        Ok(())
    }

    /// Shows `solids` beside the cloth in the formats of geometry that can.
    pub fn solids_set(&mut self, solids: &FrameSolids) {
        for files in &mut Arc::make_mut(&mut self.work).files {
            files.solids = Some(solids.clone());
        }
    }

    /// Takes a frame; `picture` is what to show instead of drawing it.
    ///
    /// # Errors
    ///
    /// [`FrameError::ParticleCount`] or [`FrameError::Position`] of this frame, or what went wrong
    /// with an earlier one: [`FrameError::Write`] or [`FrameError::Picture`].
    pub fn write(
        &mut self,
        frame: &Frame<'_>,
        picture: Option<RgbImage>,
    ) -> Result<(), FrameError> {
        frame.check(self.work.topology.particle_count)?;
        while let Ok(outcome) = self.receiver.try_recv() {
            self.outcomes.extend([outcome]);
        }
        while self.under_way() >= self.limit {
            self.wait();
        }
        self.report()?;
        let is_geometry = !self.work.files.is_empty();
        let geometry =
            |values: Option<&[[f64; 3]]>| values.filter(|_| is_geometry).map(<[[f64; 3]]>::to_vec);
        let frame = OwnedFrame {
            index: frame.index,
            time: frame.time,
            positions: frame.positions.to_vec(),
            velocities: geometry(frame.velocities),
            normals: geometry(frame.normals),
            picture,
        };
        let (work, sender, number) = (Arc::clone(&self.work), self.sender.clone(), self.taken);
        self.taken += 1;
        self.pool.spawn_fifo(move || {
            // The other end is there as long as anybody wants to know.
            let _ = sender.send((number, work.write(frame)));
        });
        Ok(())
    }

    /// Waits until the files of all frames are written.
    ///
    /// # Errors
    ///
    /// What went wrong with the earliest frame that has not been told of: [`FrameError::Write`] or
    /// [`FrameError::Picture`].
    pub fn finish(&mut self) -> Result<(), FrameError> {
        while self.under_way() > 0 {
            self.wait();
        }
        self.report()
    }

    /// Frames that were taken and whose outcome has not come back.
    fn under_way(&self) -> u64 {
        self.taken - self.reported - self.outcomes.len() as u64
    }

    fn wait(&mut self) {
        // There is always a sender: this one.
        self.outcomes.extend(self.receiver.recv());
    }

    /// Looks at the outcomes of frames in their order, as far as they have come back.
    fn report(&mut self) -> Result<(), FrameError> {
        let mut is_longer = false;
        let mut failed = None;
        while failed.is_none()
            && let Some(outcome) = self.outcomes.remove(&self.reported)
        {
            self.reported += 1;
            match outcome {
                Ok((index, time)) => {
                    for (_, times) in &mut self.collections {
                        times.insert(index, time);
                        is_longer = true;
                    }
                }
                Err(error) => failed = Some(error),
            }
        }
        if is_longer {
            for (files, times) in &self.collections {
                files.collection_write(times.iter())?;
            }
        }
        failed.map_or(Ok(()), Err)
    }
}

impl Drop for FramePipeline {
    /// Lets what is under way come to its end: no file is left half written.
    fn drop(&mut self) {
        while self.under_way() > 0 {
            self.wait();
        }
    }
}

impl Work {
    /// Writes all files of a frame.
    fn write(&self, frame: OwnedFrame) -> Outcome {
        let (index, time) = (frame.index, frame.time);
        let geometry = Frame {
            velocities: frame.velocities.as_deref(),
            normals: frame.normals.as_deref(),
            ..Frame::new(index, time, &frame.positions)
        };
        for files in &self.files {
            files.write(&self.topology, &geometry)?;
        }
        let mut image = frame.picture;
        for (files, size) in &self.pictures {
            let drawn = match (image, &self.renderer) {
                (Some(image), _) => image,
                (None, Some(renderer)) => {
                    renderer.render(&self.topology, time, &frame.positions)?
                }
                (None, None) => break,
            };
            let drawn = scaled(drawn, *size);
            files.picture_write(index, &drawn)?;
            image = Some(drawn);
        }
        Ok((index, time))
    }
}
