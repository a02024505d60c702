//! What the window drives: a scene in progress, or the frames of a run.
//!
//! [`Engine`] and [`Playback`] do their work when they are told to, without threads or a window;
//! [`SimulationThread`] runs either of them beside the window.

mod contacts;
mod engine;
mod frame_files;
mod grab;
mod kept;
mod message;
mod pick;
mod pick_gpu;
mod pins;
mod playback;
mod save;
mod settings;
mod snapshot;
mod source;
mod thread;

pub use engine::Engine;
pub use frame_files::FrameFiles;
pub use kept::KeptView;
pub use message::{Listener, Message, Severity};
pub use pins::corner_particles;
pub use playback::Playback;
pub use save::scene_save;
pub use settings::{ClothSettings, Settings, SettingsChange, SurfaceSettings};
pub use snapshot::{GrabView, Snapshot};
pub use source::Source;
pub use thread::{Command, Shown, SimulationThread, Subject};
