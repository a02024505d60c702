//! What can go wrong with frames.

use std::io;
use std::path::{Path, PathBuf};

use crate::frame::FrameFormat;
use crate::picture::PictureError;

/// Frames that cannot be stored, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// An output file could not be written.
    #[error(
        "cannot write `{}` ({source}); check free space and permissions or choose another folder",
        file.display()
    )]
    Write {
        /// The file.
        file: PathBuf,
        /// Reason given by the operating system or the encoder.
        source: io::Error,
    },
    /// A file could not be read.
    #[error("cannot read `{}` ({source}); check the path and the permissions", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The system gives no threads for writing.
    #[error("no threads to write frames with ({source}); ask for fewer threads")]
    Threads {
        /// Reason given by the system.
        source: rayon::ThreadPoolBuildError,
    },
    /// The file is not a frame store or lost its header.
    #[error("`{}` is not a frame store; give the file that the run wrote", file.display())]
    StoreMagic {
        /// The file.
        file: PathBuf,
    },
    /// The frame store has another format version.
    #[error(
        "frame store `{}` has format version {found} but this program reads 1 to {expected}; \
         use the program that wrote it or run the simulation again",
        file.display()
    )]
    StoreVersion {
        /// The file.
        file: PathBuf,
        /// Version of the file.
        found: u32,
        /// Version of this program.
        expected: u32,
    },
    /// The header of the frame store is not the one that was written.
    #[error(
        "frame store `{}` is damaged: the checksum of its header is {found:08x} but its content has \
         {expected:08x}; run the simulation again",
        file.display()
    )]
    StoreHeader {
        /// The file.
        file: PathBuf,
        /// Checksum in the file.
        found: u32,
        /// Checksum of the content.
        expected: u32,
    },
    /// A frame of the store is not the one that was written.
    #[error(
        "frame {index} of frame store `{}` is damaged: {problem}; run the simulation again",
        file.display()
    )]
    StoreDamaged {
        /// The file.
        file: PathBuf,
        /// The frame, zero based.
        index: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The frame store belongs to other cloths.
    #[error(
        "frame store `{}` was written for other meshes ({found} particles, this scene has \
         {expected} particles); use the scene of that run or another output folder",
        file.display()
    )]
    StoreTopology {
        /// The file.
        file: PathBuf,
        /// Particles in the file.
        found: u64,
        /// Particles expected.
        expected: u64,
    },
    /// The frame store has another frame rate.
    #[error(
        "frame store `{}` was written with {found} frames per second but the scene has \
         {expected}; set the scene back or use another output folder",
        file.display()
    )]
    StoreRate {
        /// The file.
        file: PathBuf,
        /// Frame rate of the file \[1/s\].
        found: f64,
        /// Frame rate expected \[1/s\].
        expected: f64,
    },
    /// Another process appends to the frame store.
    #[error(
        "frame store `{}` is being written by another run; wait for it or use another output folder",
        file.display()
    )]
    StoreLocked {
        /// The file.
        file: PathBuf,
    },
    /// The store was opened for reading.
    #[error("frame store `{}` is open for reading only; open it for appending", file.display())]
    StoreReadOnly {
        /// The file.
        file: PathBuf,
    },
    /// A frame that the store does not have.
    #[error("frame {index} does not exist, the store has {count} frames; ask for an earlier one")]
    FrameIndex {
        /// The frame asked for, zero based.
        index: usize,
        /// Frames in the store.
        count: usize,
    },
    /// A container of no frames.
    #[error("frame store `{}` has no frames; run the simulation first", file.display())]
    FrameNone {
        /// The store.
        file: PathBuf,
    },
    /// An array of a frame has the wrong length.
    #[error(
        "the frame has values for {found} particles but the run has {expected}; \
         pass the arrays of the same model"
    )]
    ParticleCount {
        /// Length of the array.
        found: usize,
        /// Particles of the run.
        expected: usize,
    },
    /// A position is infinite or not a number, or does not fit the single precision of most formats;
    /// all refuse it alike.
    #[error(
        "the position of particle {particle} is not finite; \
         the simulation has diverged, use a smaller time step"
    )]
    Position {
        /// The particle, zero based.
        particle: usize,
    },
    /// A velocity or a normal is not finite in the same sense.
    #[error(
        "the {what} of particle {particle} is not finite; \
         the simulation has diverged, use a smaller time step"
    )]
    Vector {
        /// `velocity` or `normal`.
        what: &'static str,
        /// The particle, zero based.
        particle: usize,
    },
    /// The time of a frame is not finite.
    #[error("frame {index} has the time {time} s; pass the time of the simulation")]
    Time {
        /// The frame, zero based.
        index: u64,
        /// Its time \[s\].
        time: f64,
    },
    /// Parts of the topology do not fit together.
    #[error("the topology is inconsistent: {problem}; build it from the model of the run")]
    Topology {
        /// The part that does not fit.
        problem: String,
    },
    /// A container format where one file per frame was asked for, or the reverse.
    #[error("format `{format}` is {is}; use {instead}")]
    Kind {
        /// The format.
        format: FrameFormat,
        /// What it is.
        is: &'static str,
        /// What to use instead.
        instead: &'static str,
    },
    /// The frames do not fit into the format.
    #[error(
        "`{}` would need {needed} {unit} but the format allows {limit}; use a larger frame stride",
        file.display()
    )]
    Size {
        /// The file.
        file: PathBuf,
        /// What is counted.
        unit: &'static str,
        /// How much is needed.
        needed: u64,
        /// How much is possible.
        limit: u64,
    },
    /// The picture could not be made.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

impl FrameError {
    /// Makes a write error of `file` from any error of an encoder.
    pub(crate) fn write<E>(file: &Path) -> impl FnOnce(E) -> Self
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        let file = file.to_owned();
        move |error| {
            let error: Box<dyn std::error::Error + Send + Sync> = error.into();
            let source = match error.downcast::<io::Error>() {
                Ok(error) => *error,
                Err(error) => io::Error::other(error),
            };
            Self::Write { file, source }
        }
    }
}
