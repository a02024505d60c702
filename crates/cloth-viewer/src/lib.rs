#![doc = include_str!("../README.md")]

mod clip;
mod error;
mod gpu;
mod headless;
mod renderer;
mod simulation;
mod window;

pub use clip::ClipFormat;
pub use error::ViewerError;
pub use gpu::Gpu;
pub use headless::{ClipOptions, FramePainter, Studio, clip_render};
pub use renderer::{
    ClothMesh, Disc, FrameBuffers, FrameContents, LineEnd, OrbitCamera, Overlays, PlaceLine, Ray,
    RenderTarget, Renderer,
};
pub use simulation::{
    ClothSettings, Command, Engine, FrameFiles, GrabView, KeptView, Listener, Message, Playback,
    Settings, SettingsChange, Severity, Shown, SimulationThread, Snapshot, Source, Subject,
    SurfaceSettings, corner_particles, scene_save,
};
pub use window::{WindowOptions, window_run};
