//! A line of JSON about every frame that is shown, for scripts that drive the window.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{BufWriter, Write},
    path::Path,
};

use serde::Serialize;

use crate::{Message, OrbitCamera, Overlays, Settings, Severity, Snapshot, ViewerError};

/// What is told of a frame.
#[derive(Serialize)]
struct Line<'a> {
    scene: &'a str,
    frame: u64,
    /// Simulated time \[s\].
    time: f64,
    paused: bool,
    /// Particles that are held.
    held: &'a [u32],
    /// The particle under the pointer's pull, where it is, if the host knows, and where it is pulled \[m\].
    grabbed: Option<(u32, Option<[f64; 3]>, [f64; 3])>,
    wires: bool,
    fullscreen: bool,
    /// Settings in force \[s\], \[m/s\]; none for recorded frames.
    time_step: Option<f64>,
    wind: Option<[f64; 3]>,
    /// \[m/s^2\].
    gravity: Option<[f64; 3]>,
    /// Stiffness of the stretch springs of each cloth \[N/m\].
    stretch: Vec<f64>,
    /// Changes that can be taken back, and made again.
    undo: usize,
    redo: usize,
    /// First and last frame that is kept, and whether the simulation is farther than the frame that is shown.
    kept: Option<[u64; 2]>,
    past: bool,
    /// Where widgets are: left, top, right and lower edge \[point\].
    widgets: &'a BTreeMap<&'static str, [f32; 4]>,
    /// Whether keys are letters.
    typing: bool,
    /// Where the pointer is \[point\], and whether a button of the mouse is down.
    pointer: Option<[f32; 2]>,
    pressed: bool,
    help: bool,
    recording: bool,
    /// Number of recorded frames, for the frames of a run.
    recorded: Option<usize>,
    /// Energy \[J\] and largest strain.
    energy: f64,
    strain_max: f64,
    /// Left, top, right and lower edge of the picture in the window \[point\].
    picture: [f32; 4],
    eye: [f64; 3],
    message: Option<&'a str>,
    /// Whether the message is an error.
    error: bool,
}

/// What the window adds to a frame.
pub(super) struct Surroundings<'a> {
    pub(super) scene: &'a str,
    pub(super) overlays: Overlays,
    pub(super) camera: &'a OrbitCamera,
    pub(super) fullscreen: bool,
    pub(super) settings: Option<&'a Settings>,
    pub(super) widgets: &'a BTreeMap<&'static str, [f32; 4]>,
    pub(super) typing: bool,
    pub(super) pointer: Option<eframe::egui::Pos2>,
    pub(super) pressed: bool,
    pub(super) help: bool,
    pub(super) recording: bool,
    pub(super) picture: eframe::egui::Rect,
    pub(super) message: Option<&'a Message>,
    pub(super) undo: usize,
    pub(super) redo: usize,
}

/// The file.
pub(super) struct SessionLog {
    file: BufWriter<File>,
    last: String,
}

impl SessionLog {
    pub(super) fn create(path: &Path) -> Result<Self, ViewerError> {
        let file = File::create(path).map_err(|error| ViewerError::Output {
            path: path.to_owned(),
            problem: error.to_string(),
            mend: "check the folder and the permissions",
        })?;
        Ok(Self { file: BufWriter::new(file), last: String::new() })
    }

    /// Writes a line, unless it says what the last one said.
    pub(super) fn write(&mut self, snapshot: &Snapshot, around: &Surroundings<'_>) {
        let line = Line {
            scene: around.scene,
            frame: snapshot.frame,
            time: snapshot.time,
            paused: snapshot.paused,
            held: &snapshot.held,
            grabbed: snapshot.grab.map(|grab| (grab.particle, grab.position, grab.target)),
            wires: around.overlays.wires,
            fullscreen: around.fullscreen,
            time_step: around.settings.map(|settings| settings.time_step),
            wind: around.settings.map(|settings| settings.air.map_or([0.0; 3], |air| air.velocity)),
            gravity: around.settings.map(|settings| settings.gravity),
            stretch: around.settings.map_or_else(Vec::new, |settings| {
                settings.cloths.iter().map(|cloth| cloth.material.stretch.stiffness).collect()
            }),
            undo: around.undo,
            redo: around.redo,
            kept: snapshot.kept.and_then(|kept| kept.range),
            past: snapshot.is_past,
            widgets: around.widgets,
            typing: around.typing,
            pointer: around.pointer.map(|place| [place.x, place.y]),
            pressed: around.pressed,
            help: around.help,
            recording: around.recording,
            recorded: snapshot.recorded,
            energy: snapshot.report.measures.energy(),
            strain_max: snapshot.report.measures.strain_max,
            picture: [
                around.picture.min.x,
                around.picture.min.y,
                around.picture.max.x,
                around.picture.max.y,
            ],
            eye: around.camera.eye(),
            message: around.message.map(|message| &*message.text),
            error: around.message.is_some_and(|message| message.severity == Severity::Error),
        };
        let Ok(text) = serde_json::to_string(&line) else { return };
        if text != self.last {
            // A log that cannot be written is no reason to end a session.
            let _ = writeln!(self.file, "{text}").and_then(|()| self.file.flush());
            self.last = text;
        }
    }
}
