//! The simulation beside the window.

use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, Sender, TryRecvError, channel},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use cloth::{Model, io::PictureStyle};

use crate::{Gpu, Overlays, Ray, ViewerError};

use super::{
    Engine, Message, Playback, Settings, Snapshot, Source, playback::frame_time, scene_save,
};

/// What the window asks for.
#[derive(Clone, Debug)]
pub enum Command {
    /// Waits, or goes on from the last frame.
    PauseToggle,
    /// The next frame, and then waits: one that is kept while an earlier one is shown, else a new one.
    Step,
    /// The frame before, if it is kept, and then waits.
    StepBack,
    /// Back to the start.
    Reset,
    /// Holds or lets go one of the corners 0 to 3.
    CornerToggle(usize),
    /// Holds or lets go the particle under the pointer.
    PinToggle(Ray),
    /// Takes hold of the cloth under the pointer.
    GrabBegin(Ray),
    /// Pulls.
    GrabMove(Ray),
    /// Lets go.
    GrabEnd,
    /// Changes settings.
    Settings(Settings),
    /// What is drawn, as some of it has to be computed.
    Overlays(Overlays),
    /// Shows something else; with this backend, if it is a scene.
    Open(Source, String),
    /// Shows a recorded frame, or one that is kept, and waits. The simulation stays where it is.
    Seek(u64),
    /// Goes back to the frame that is shown, and on from there; what came after it is forgotten.
    GoOnFromHere,
    /// Writes the scene under the settings in force.
    Save {
        /// The file, TOML.
        path: PathBuf,
        /// Whether an existing file is to be replaced.
        replace: bool,
    },
    /// Whether every frame is wanted: then each waits until the one before was taken.
    Record(bool),
    /// The newest frame was taken.
    Taken,
}

/// What the window sees of the simulation.
#[derive(Clone, Default)]
pub struct Shown {
    /// The newest frame.
    pub snapshot: Option<Snapshot>,
    /// What is shown; changes with every scene that is opened.
    pub subject: Option<Subject>,
    /// Settings in force.
    pub settings: Option<Settings>,
    /// Number of changes of settings that were answered, accepted or refused.
    pub settings_answered: u64,
    /// The last thing that went wrong, or that is to be said.
    pub message: Option<Message>,
    /// Counts messages, so that the same one is seen twice.
    pub message_number: u64,
}

/// What is shown.
#[derive(Clone)]
pub struct Subject {
    /// Counts the scenes that were opened.
    pub number: u64,
    /// Name of the scene.
    pub name: String,
    /// Its model.
    pub model: Arc<Model>,
    /// How pictures of it look.
    pub style: PictureStyle,
    /// Frames in a second \[Hz\].
    pub frames_per_second: f64,
}

/// A simulation on a thread of its own.
pub struct SimulationThread {
    commands: Option<Sender<Command>>,
    shown: Arc<Mutex<Shown>>,
    thread: Option<JoinHandle<()>>,
}

impl SimulationThread {
    /// Starts with `source`; frames of scenes in progress are kept in at most `keep` bytes, and `on_frame` is called whenever there is
    /// something new to see.
    #[must_use]
    pub fn start(
        gpu: &Gpu,
        source: Source,
        backend: &str,
        paused: bool,
        keep: u64,
        on_frame: impl Fn() + Send + 'static,
    ) -> Self {
        let (commands, receiver) = channel();
        let shown = Arc::new(Mutex::new(Shown::default()));
        let worker_shown = Arc::clone(&shown);
        let (gpu, backend) = (gpu.clone(), backend.to_owned());
        let thread = std::thread::spawn(move || {
            let mut worker = Worker {
                gpu,
                session: None,
                shown: worker_shown,
                paused,
                keep,
                past: None,
                recording: false,
                wanted: false,
                overlays: Overlays::default(),
                subjects: 0,
                due: Instant::now(),
                last: None,
                real_time_factor: 0.0,
                on_frame: Box::new(on_frame),
            };
            worker.open(source, &backend);
            worker.run(&receiver);
        });
        Self { commands: Some(commands), shown, thread: Some(thread) }
    }

    /// Asks for something; returns at once.
    pub fn send(&self, command: Command) {
        if let Some(commands) = &self.commands {
            // The thread ends before this value only by a panic, which `Drop` reports.
            let _ = commands.send(command);
        }
    }

    /// What there is to see; cheap to copy.
    #[must_use]
    pub fn shown(&self) -> Shown {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether the thread still works.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

impl Drop for SimulationThread {
    fn drop(&mut self) {
        // Without a sender the thread ends.
        self.commands = None;
        if let Some(thread) = self.thread.take() {
            // What went wrong in a panic was said where it happened.
            let _ = thread.join();
        }
    }
}

enum Session {
    Live(Box<Engine>),
    Recorded(Box<Playback>),
}

struct Worker {
    gpu: Gpu,
    session: Option<Session>,
    shown: Arc<Mutex<Shown>>,
    paused: bool,
    /// Memory for frames that are kept \[byte\].
    keep: u64,
    /// The earlier frame that is shown, if one is.
    past: Option<u64>,
    /// Whether every frame is wanted, and whether the newest one still is.
    recording: bool,
    wanted: bool,
    overlays: Overlays,
    subjects: u64,
    /// When the next frame is to be shown.
    due: Instant,
    /// When the last frame was done.
    last: Option<Instant>,
    real_time_factor: f64,
    on_frame: Box<dyn Fn() + Send>,
}

impl Worker {
    fn run(&mut self, commands: &Receiver<Command>) {
        loop {
            let wait = self.due.saturating_duration_since(Instant::now());
            let waits = self.paused || self.recording && self.wanted;
            let received = if waits || self.session.is_none() {
                commands.recv().map_err(|_| TryRecvError::Disconnected)
            } else if wait.is_zero() {
                commands.try_recv()
            } else {
                commands.recv_timeout(wait).map_err(|error| match error {
                    std::sync::mpsc::RecvTimeoutError::Timeout => TryRecvError::Empty,
                    std::sync::mpsc::RecvTimeoutError::Disconnected => TryRecvError::Disconnected,
                })
            };
            match received {
                Ok(command) => self.command(command),
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => self.frame(),
            }
        }
    }

    /// Computes a frame and shows it.
    fn frame(&mut self) {
        let outcome = match &mut self.session {
            Some(Session::Live(engine)) => engine.step(),
            Some(Session::Recorded(playback)) => {
                playback.step();
                Ok(())
            }
            None => Ok(()),
        };
        let now = Instant::now();
        let length = self.frame_time();
        if let Some(last) = self.last.replace(now) {
            let factor = length.as_secs_f64() / (now - last).as_secs_f64().max(1e-9);
            self.real_time_factor += 0.2 * (factor - self.real_time_factor);
        }
        self.wanted = true;
        // What was missed is not caught up with.
        self.due = (self.due + length).max(now);
        if let Err(error) = outcome {
            self.paused = true;
            let place = match &self.session {
                Some(Session::Live(engine)) if engine.frame() > 0 => {
                    format!("back at frame {}, the last good one, paused", engine.frame())
                }
                _ => "back at the start, paused".into(),
            };
            self.say(Message::error(&format!("{error}; {place}")));
        }
        self.publish();
    }

    fn frame_time(&self) -> Duration {
        match &self.session {
            Some(Session::Live(engine)) => frame_time(engine.scene().frames_per_second),
            Some(Session::Recorded(playback)) => frame_time(playback.frames_per_second()),
            None => Duration::from_millis(100),
        }
    }

    fn command(&mut self, command: Command) {
        let is_settings = matches!(command, Command::Settings(_));
        if let Err(error) = self.obey(command) {
            self.say(Message::error(&error));
        }
        if is_settings {
            self.show(|shown| shown.settings_answered += 1);
        }
    }

    fn obey(&mut self, command: Command) -> Result<(), ViewerError> {
        match command {
            Command::PauseToggle => {
                // While an earlier frame is shown nothing runs.
                self.paused = !self.paused;
                self.past = None;
                self.due = Instant::now();
                self.last = None;
            }
            Command::Step => {
                self.paused = true;
                match (self.past, &self.session) {
                    (Some(past), Some(Session::Live(engine))) => {
                        self.past = (past + 1 < engine.frame()).then_some(past + 1);
                    }
                    _ => {
                        self.frame();
                        return Ok(());
                    }
                }
            }
            Command::StepBack => {
                self.paused = true;
                match &mut self.session {
                    Some(Session::Live(engine)) => {
                        let shown = self.past.unwrap_or(engine.frame());
                        self.past = past_frame(engine, shown.saturating_sub(1));
                    }
                    Some(Session::Recorded(playback)) => playback.step_back(),
                    None => {}
                }
            }
            Command::GoOnFromHere => {
                if let (Some(past), Some(Session::Live(engine))) =
                    (self.past.take(), &mut self.session)
                {
                    engine.restore(past)?;
                    self.paused = false;
                    self.due = Instant::now();
                    self.last = None;
                }
            }
            Command::Save { path, replace } => {
                let Some(Session::Live(engine)) = &self.session else { return Ok(()) };
                let saved = scene_save(&engine.scene_present(), &path, replace)?;
                self.say(saved);
                return Ok(());
            }
            Command::Overlays(overlays) => self.overlays = overlays,
            Command::Record(on) => {
                self.recording = on;
                self.wanted = on;
            }
            Command::Taken => {
                self.wanted = false;
                return Ok(());
            }
            Command::Open(source, backend) => {
                self.open(source, &backend);
                return Ok(());
            }
            Command::Seek(index) => {
                self.paused = true;
                match &mut self.session {
                    Some(Session::Live(engine)) => self.past = past_frame(engine, index),
                    Some(Session::Recorded(playback)) => {
                        playback.seek(usize::try_from(index).unwrap_or(usize::MAX));
                    }
                    None => {}
                }
            }
            Command::Reset => {
                self.past = None;
                match &mut self.session {
                    Some(Session::Live(engine)) => engine.reset()?,
                    Some(Session::Recorded(playback)) => playback.seek(0),
                    None => {}
                }
            }
            command => {
                if let (Some(past), true) = (self.past, command.is_touch()) {
                    self.say(Message::info(format!(
                        "frame {past} is the past: go on from it, or from the last frame (space), to touch the cloth"
                    )));
                } else if let Some(Session::Live(engine)) = &mut self.session {
                    touch(engine, command)?;
                }
            }
        }
        self.publish();
        Ok(())
    }

    fn open(&mut self, source: Source, backend: &str) {
        let opened = match source {
            Source::Scene(scene, options) => Engine::new(&self.gpu, *scene, options, backend)
                .and_then(|mut engine| {
                    engine.keep_frames(self.keep)?;
                    Ok(Session::Live(Box::new(engine)))
                }),
            Source::Run { scene, options, store } => {
                Playback::of_store(&self.gpu, &scene, &options, &store)
                    .map(|playback| Session::Recorded(Box::new(playback)))
            }
            Source::Files(files) => Playback::of_files(&self.gpu, files)
                .map(|playback| Session::Recorded(Box::new(playback))),
        };
        match opened {
            Ok(session) => {
                self.subjects += 1;
                let number = self.subjects;
                let subject = match &session {
                    Session::Live(engine) => Subject {
                        number,
                        name: engine.scene().name.clone(),
                        model: Arc::clone(&engine.scene().model),
                        style: engine.style().clone(),
                        frames_per_second: engine.scene().frames_per_second,
                    },
                    Session::Recorded(playback) => Subject {
                        number,
                        name: playback.name().to_owned(),
                        model: Arc::clone(playback.model()),
                        style: playback.style().clone(),
                        frames_per_second: playback.frames_per_second(),
                    },
                };
                self.session = Some(session);
                self.past = None;
                self.due = Instant::now();
                self.last = None;
                self.show(|shown| {
                    shown.subject = Some(subject);
                    shown.snapshot = None;
                    shown.settings = None;
                });
                self.publish();
            }
            Err(error) => self.say(Message::error(&error)),
        }
    }

    fn publish(&mut self) {
        let (snapshot, settings) = match &mut self.session {
            Some(Session::Live(engine)) => {
                let past = self.past.map(|past| engine.snapshot_past(past, self.overlays));
                let snapshot = match past.and_then(Result::transpose) {
                    Some(snapshot) => snapshot,
                    None => {
                        self.past = None;
                        engine.snapshot(self.overlays)
                    }
                };
                (snapshot, Some(engine.settings().clone()))
            }
            Some(Session::Recorded(playback)) => (playback.snapshot(self.overlays), None),
            None => return,
        };
        match snapshot {
            Ok(snapshot) => {
                let snapshot = Snapshot {
                    paused: self.paused,
                    real_time_factor: self.real_time_factor,
                    ..snapshot
                };
                self.show(|shown| {
                    shown.snapshot = Some(snapshot);
                    shown.settings = settings;
                });
            }
            Err(error) => self.say(Message::error(&error)),
        }
    }

    fn say(&mut self, message: Message) {
        self.show(|shown| {
            shown.message = Some(message);
            shown.message_number += 1;
        });
    }

    fn show(&mut self, change: impl FnOnce(&mut Shown)) {
        change(&mut self.shown.lock().unwrap_or_else(PoisonError::into_inner));
        (self.on_frame)();
    }
}

impl Command {
    /// Whether it begins to act on particles that are seen.
    const fn is_touch(&self) -> bool {
        matches!(self, Self::CornerToggle(_) | Self::PinToggle(_) | Self::GrabBegin(_))
    }
}

/// The kept frame nearest to `number`, unless that is the present one.
fn past_frame(engine: &Engine, number: u64) -> Option<u64> {
    let [first, _] = engine.kept()?.range?;
    let number = number.max(first);
    (number < engine.frame()).then_some(number)
}

/// What acts on a scene in progress alone.
fn touch(engine: &mut Engine, command: Command) -> Result<(), ViewerError> {
    match command {
        Command::CornerToggle(corner) => {
            engine.corner_toggle(corner);
        }
        Command::PinToggle(ray) => {
            if let Some(particle) = engine.pick(&ray)? {
                engine.pin_toggle(particle);
            }
        }
        Command::GrabBegin(ray) => {
            engine.grab_begin(&ray)?;
        }
        Command::GrabMove(ray) => engine.grab_move(&ray),
        Command::GrabEnd => engine.grab_end(),
        Command::Settings(settings) => {
            engine.apply(&settings)?;
        }
        // The others concern every session.
        _ => {}
    }
    Ok(())
}
