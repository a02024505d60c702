//! What can go wrong in the viewer.

use std::path::PathBuf;

use cloth::{BackendError, Error, PoseLogError, io::FrameError, scene::SceneError};

/// A viewer that cannot do what was asked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewerError {
    /// The engine refused, or there is no device.
    #[error(transparent)]
    Simulation(#[from] Error),
    /// There is no such backend.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// A scene that cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Frames that cannot be read or written.
    #[error(transparent)]
    Frames(#[from] FrameError),
    /// Poses of rigid bodies that cannot be read.
    #[error(transparent)]
    Poses(#[from] PoseLogError),
    /// Neither a scene nor frames.
    #[error("cannot open `{}` ({problem}); give a .toml or .fysl file, a built-in scene, the folder that \
             `cloth run` wrote, or frames as .obj, .ply, .pc2 or .mdd", path.display())]
    Source {
        /// What was given.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// No window can be opened.
    #[error("cannot open a window: {reason}; {mend}")]
    Window {
        /// What the system says.
        reason: String,
        /// What to do.
        mend: &'static str,
    },
    /// A picture or clip that cannot be written.
    #[error("cannot write `{}` ({problem}); {mend}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
        /// What to do.
        mend: &'static str,
    },
    /// A picture of no size or larger than the device can hold.
    #[error("a picture of {width} x {height} pixels cannot be drawn; use sides of 1 to {limit}")]
    PictureSize {
        /// Width asked for \[pixel\].
        width: u32,
        /// Height asked for \[pixel\].
        height: u32,
        /// Largest side of this device \[pixel\].
        limit: u32,
    },
    /// The device failed while a picture was read.
    #[error("the GPU failed: {reason}; restart, or choose another adapter with --adapter")]
    Device {
        /// What the driver says.
        reason: String,
    },
}
