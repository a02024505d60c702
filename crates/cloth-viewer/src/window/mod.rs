//! The window.

mod app;
mod colours;
mod graphs;
mod history;
mod icons;
mod keys;
mod messages;
mod panel;
mod parameters;
mod places;
mod pointer;
mod recording;
mod save_window;
mod session_log;
mod setup;
mod timeline;

use std::path::PathBuf;

use cloth::{AUTO, backend_create};

use crate::{Listener, Source, ViewerError};

/// What a window is opened with.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// What is shown first.
    pub source: Source,
    /// Name of the backend; `auto` chooses.
    pub backend: String,
    /// Number of the GPU that draws, or part of its name; the best one if `None`.
    pub adapter: Option<String>,
    /// Whether it begins paused.
    pub paused: bool,
    /// Width and height \[point\].
    pub size: [f32; 2],
    /// Folder for screenshots and recordings.
    pub folder: PathBuf,
    /// Memory for frames that can be gone back to \[byte\].
    pub keep: u64,
    /// File for a line of JSON about every frame that is shown.
    pub log: Option<PathBuf>,
    /// Who else is told what the window says.
    pub listener: Listener,
}

/// Opens the window; returns when it is closed.
///
/// # Errors
/// What is wrong with the source or the backend; [`ViewerError::Window`] in one line with the package that is missing, if there is no display or no
/// adapter.
pub fn window_run(options: WindowOptions) -> Result<(), ViewerError> {
    // What cannot be shown is said where the program was started, not in an empty window.
    options.source.check()?;
    if ![AUTO, "wgpu"].contains(&&*options.backend) {
        backend_create(&options.backend, None)?;
    }
    let native = setup::native_options(&options);
    let ran = eframe::run_native(
        "cloth",
        native,
        Box::new(|context| Ok(Box::new(app::ViewerApp::new(context, options)?))),
    );
    ran.map_err(setup::window_error)
}
