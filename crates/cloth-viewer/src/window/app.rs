//! The window and what it remembers.

use std::{
    path::PathBuf,
    sync::mpsc::{Receiver, Sender, channel},
    thread::JoinHandle,
};

use cloth::wgpu::wgpu;
use eframe::{
    CreationContext, Frame,
    egui::{
        self, CentralPanel, Color32, Context, Margin, Panel, Pos2, Rect, ScrollArea, Sense,
        TextureId, Ui, ViewportCommand, pos2,
    },
    egui_wgpu::RenderState,
};

use crate::{
    ClipFormat, ClothMesh, Command, Gpu, OrbitCamera, Overlays, RenderTarget, Renderer, Settings,
    Shown, SimulationThread, Snapshot, Source, ViewerError, headless::camera,
};

use super::{
    WindowOptions,
    graphs::Graphs,
    history::History,
    keys::{self, Action},
    messages::Messages,
    panel::{PanelRequest, PanelState, PanelView},
    places,
    pointer::pointer,
    recording::{Recording, screenshot},
    save_window::{SaveRequest, SaveWindow},
    session_log::{SessionLog, Surroundings},
    timeline::timeline,
};

/// Heights of the bars at the bottom, of the curves at first, and width of the panel \[point\].
const STATUS: f32 = 28.0;
const TIMELINE: f32 = 62.0;
const GRAPHS: f32 = 250.0;
const PANEL: f32 = 320.0;
/// Width of the speed in the bar at the bottom \[point\].
const SPEED: f32 = 360.0;
/// The light of a recorder.
const RECORDING: Color32 = Color32::from_rgb(255, 110, 100);

/// What is told to the window from elsewhere.
enum Notice {
    /// A file that was chosen.
    Chosen(PathBuf),
    /// Where to save.
    SaveAs(PathBuf),
    /// Something to say.
    Say(String),
    /// A clip that could not be made.
    RecordingFailed(String),
}

pub(super) struct ViewerApp {
    gpu: Gpu,
    render_state: RenderState,
    renderer: Renderer,
    simulation: SimulationThread,
    shown: Shown,
    subject: Option<Drawn>,
    target: Option<(RenderTarget, TextureId)>,
    picture: Rect,
    overlays: Overlays,
    overlays_sent: Overlays,
    /// The settings in the panel, and those that were asked for, with what was before.
    edited: Option<Settings>,
    history: Option<History<Settings>>,
    /// Changes of settings that were asked for, and how many of them were answered.
    settings_asked: u64,
    settings_answered: u64,
    backends: Vec<&'static str>,
    graphs: Graphs,
    help: bool,
    pulled_to: Option<Pos2>,
    recording: Option<Recording>,
    clip_format: ClipFormat,
    panel: PanelState,
    save: SaveWindow,
    /// What is still being written.
    writers: Vec<JoinHandle<()>>,
    messages: Messages,
    message_seen: u64,
    notices: (Sender<Notice>, Receiver<Notice>),
    backend: String,
    folder: PathBuf,
    /// The folder of the scene that was opened last, if it is a file.
    scene_folder: Option<PathBuf>,
    log: Option<SessionLog>,
}

/// What belongs to the scene that is drawn.
struct Drawn {
    number: u64,
    name: String,
    mesh: ClothMesh,
    start_camera: OrbitCamera,
    camera: OrbitCamera,
    /// Width over height of the pictures that the camera was made for, until it fits the window.
    aspect: Option<f64>,
    frames_per_second: f64,
}

impl Drawn {
    /// Steps back as far as is needed to see in a narrow window what a wide picture shows.
    fn fit(&mut self, aspect: f64) {
        if let Some(wanted) = self.aspect.take() {
            self.start_camera.distance *= (wanted / aspect.max(0.1)).max(1.0);
            self.camera = self.start_camera;
        }
    }
}

impl ViewerApp {
    pub(super) fn new(
        context: &CreationContext<'_>,
        options: WindowOptions,
    ) -> Result<Self, ViewerError> {
        let render_state = context.wgpu_render_state.clone().ok_or(ViewerError::Window {
            reason: "the window was made without wgpu".into(),
            mend: "report this",
        })?;
        let gpu = Gpu::from_device(render_state.device.clone(), render_state.queue.clone());
        let repaint = context.egui_ctx.clone();
        let scene_folder = options.source.folder();
        let simulation = SimulationThread::start(
            &gpu,
            options.source,
            &options.backend,
            options.paused,
            options.keep,
            move || repaint.request_repaint(),
        );
        let log = options.log.as_deref().map(SessionLog::create).transpose()?;
        let overlays = Overlays { pins: true, ..Overlays::default() };
        Ok(Self {
            renderer: Renderer::new(&gpu),
            gpu,
            render_state,
            simulation,
            shown: Shown::default(),
            subject: None,
            target: None,
            picture: Rect::ZERO,
            overlays,
            overlays_sent: Overlays::default(),
            edited: None,
            history: None,
            settings_asked: 0,
            settings_answered: 0,
            backends: cloth::backends().into_iter().map(|info| info.name).collect(),
            graphs: Graphs::default(),
            help: false,
            pulled_to: None,
            recording: None,
            clip_format: ClipFormat::default(),
            panel: PanelState::default(),
            save: SaveWindow::default(),
            writers: Vec::new(),
            messages: Messages::new(options.listener),
            message_seen: 0,
            notices: channel(),
            backend: options.backend,
            folder: options.folder,
            scene_folder,
            log,
        })
    }

    fn act(&mut self, context: &Context, action: Action) {
        match action {
            Action::Pause => self.simulation.send(Command::PauseToggle),
            Action::Step => self.simulation.send(Command::Step),
            Action::StepBack => self.simulation.send(Command::StepBack),
            Action::First => self.simulation.send(Command::Seek(0)),
            Action::Last => self.simulation.send(Command::Seek(u64::MAX)),
            Action::Undo => self.history_go(History::undo),
            Action::Redo => self.history_go(History::redo),
            Action::Save => self.save_open(),
            Action::Dismiss => self.messages.dismiss(),
            Action::Reset => self.simulation.send(Command::Reset),
            Action::Corner(corner) => self.simulation.send(Command::CornerToggle(corner)),
            Action::Wires => self.overlays.wires ^= true,
            Action::Open => self.panel.word_focus = true,
            Action::Help => self.help ^= true,
            Action::Exit => context.send_viewport_cmd(ViewportCommand::Close),
            Action::Fullscreen => {
                context.send_viewport_cmd(ViewportCommand::Fullscreen(!is_fullscreen(context)));
            }
            Action::Screenshot => {
                let taken = self
                    .picture_read()
                    .and_then(|(name, picture)| screenshot(&self.folder, &name, &picture));
                match taken {
                    Ok(path) => self.messages.info(format!("screenshot `{}`", path.display())),
                    Err(error) => self.messages.error(&error),
                }
            }
            Action::Record => self.record_toggle(context),
        }
    }

    fn picture_read(&self) -> Result<(String, image::RgbImage), ViewerError> {
        match (&self.subject, &self.target) {
            (Some(subject), Some((target, _))) => {
                Ok((subject.name.clone(), target.read(&self.gpu)?))
            }
            _ => Err(ViewerError::Device { reason: "nothing is drawn yet".into() }),
        }
    }

    fn record_toggle(&mut self, context: &Context) {
        if let Some(recording) = self.recording.take() {
            self.simulation.send(Command::Record(false));
            self.messages.info(format!("writing {} frames", recording.len()));
            self.writers.retain(|writer| !writer.is_finished());
            self.writers.push(recording.end());
        } else if let Some(subject) = &self.subject {
            let (sender, context) = (self.notices.0.clone(), context.clone());
            let done = move |outcome: Result<PathBuf, ViewerError>| {
                // Nobody listens once the window is closed.
                let _ = sender.send(match outcome {
                    Ok(path) => Notice::Say(format!("recorded `{}`", path.display())),
                    Err(error) => Notice::RecordingFailed(error.to_string()),
                });
                context.request_repaint();
            };
            let (name, rate) = (&subject.name, subject.frames_per_second);
            match Recording::begin(&self.folder, name, self.clip_format, rate, done) {
                Ok(recording) => {
                    self.recording = Some(recording);
                    self.simulation.send(Command::Record(true));
                }
                Err(error) => self.messages.error(&error),
            }
        }
    }

    /// Takes a change of settings back, or makes it again.
    fn history_go(&mut self, go: impl FnOnce(&mut History<Settings>) -> Option<&Settings>) {
        if let Some(settings) = self.history.as_mut().and_then(go) {
            let settings = settings.clone();
            self.edited = Some(settings.clone());
            self.settings_send(settings);
        }
    }

    fn settings_send(&mut self, settings: Settings) {
        self.settings_asked += 1;
        self.simulation.send(Command::Settings(settings));
    }

    /// Asks where to save the scene: beside the file that it comes from, where its meshes are, or in the folder for pictures.
    fn save_open(&mut self) {
        let Some(subject) = self.subject.as_ref().filter(|_| self.edited.is_some()) else {
            self.messages.info("recorded frames are no scene that could be saved");
            return;
        };
        let folder = self.scene_folder.as_ref().unwrap_or(&self.folder);
        self.save.open(folder, &subject.name);
    }

    fn open(&mut self, source: Result<Source, ViewerError>) {
        match source {
            Ok(source) => {
                self.scene_folder = source.folder();
                self.simulation.send(Command::Open(source, self.backend.clone()));
            }
            Err(error) => self.messages.error(&error),
        }
    }

    /// Asks for a file beside the window.
    fn dialog(&self, context: &Context, folder: bool) {
        let dialog = rfd::AsyncFileDialog::new();
        let (sender, context) = (self.notices.0.clone(), context.clone());
        let chosen = async move {
            if folder {
                dialog.pick_folder().await
            } else {
                let kinds = ["toml", "bin", "obj", "ply", "pc2", "mdd"];
                dialog.add_filter("scenes and frames", &kinds).pick_file().await
            }
        };
        std::thread::spawn(move || {
            if let Some(file) = pollster::block_on(chosen) {
                // Nobody listens once the window is closed.
                let _ = sender.send(Notice::Chosen(file.path().to_owned()));
                context.request_repaint();
            }
        });
    }

    /// Asks for a place to save at, beside the window.
    fn save_dialog(&self, context: &Context) {
        let dialog = rfd::AsyncFileDialog::new().add_filter("scenes", &["toml"]);
        let (sender, context) = (self.notices.0.clone(), context.clone());
        let chosen = dialog.save_file();
        std::thread::spawn(move || {
            if let Some(file) = pollster::block_on(chosen) {
                // Nobody listens once the window is closed.
                let _ = sender.send(Notice::SaveAs(file.path().to_owned()));
                context.request_repaint();
            }
        });
    }

    fn request(&mut self, context: &Context, request: PanelRequest) {
        match request {
            PanelRequest::Command(command) => self.simulation.send(*command),
            PanelRequest::Builtin(name) => self.open(Source::open(name)),
            PanelRequest::Word(word) => self.open(Source::open(&word)),
            PanelRequest::FileDialog => self.dialog(context, false),
            PanelRequest::FolderDialog => self.dialog(context, true),
            PanelRequest::Screenshot => self.act(context, Action::Screenshot),
            PanelRequest::Record => self.act(context, Action::Record),
            PanelRequest::Help => self.act(context, Action::Help),
            PanelRequest::Undo => self.act(context, Action::Undo),
            PanelRequest::Redo => self.act(context, Action::Redo),
            PanelRequest::Save => self.act(context, Action::Save),
            PanelRequest::View => {
                if let Some(subject) = &mut self.subject {
                    subject.camera = subject.start_camera;
                }
            }
        }
    }

    /// Takes over what is new from the simulation and from elsewhere.
    fn update(&mut self) {
        let shown = self.simulation.shown();
        if shown.message_number != self.message_seen {
            self.message_seen = shown.message_number;
            if let Some(message) = shown.message.clone() {
                self.messages.say(message);
            }
        }
        if let Some(subject) = &shown.subject
            && self.subject.as_ref().is_none_or(|drawn| drawn.number != subject.number)
        {
            let start_camera = camera(&subject.style);
            self.subject = Some(Drawn {
                number: subject.number,
                name: subject.name.clone(),
                mesh: ClothMesh::new(&self.gpu, &subject.model, &subject.style),
                start_camera,
                camera: start_camera,
                aspect: Some(subject.style.aspect()),
                frames_per_second: subject.frames_per_second,
            });
            if !subject.style.overlays.is_empty() {
                let Overlays { strain, strain_measure, strain_scale, threads, .. } =
                    Overlays::of_style(&subject.style);
                self.overlays =
                    Overlays { strain, strain_measure, strain_scale, threads, ..self.overlays };
            }
            self.graphs.clear();
            self.messages.dismiss();
            self.edited = None;
            self.history = None;
        }
        self.settings_update(&shown);
        if let Some(snapshot) = &shown.snapshot {
            self.graphs.push(snapshot);
        }
        self.shown = shown;
        while let Ok(notice) = self.notices.1.try_recv() {
            match notice {
                Notice::Chosen(path) => self.open(Source::open_path(&path)),
                Notice::SaveAs(path) => self.save.choose(&path),
                Notice::Say(text) => self.messages.info(text),
                Notice::RecordingFailed(text) => {
                    self.recording = None;
                    self.simulation.send(Command::Record(false));
                    self.messages.error(&text);
                }
            }
        }
    }

    /// What came of the settings that were asked for: some may have been refused, and some come with others.
    fn settings_update(&mut self, shown: &Shown) {
        let answered = shown.settings_answered;
        let is_answer = answered != self.settings_answered && answered == self.settings_asked;
        self.settings_answered = answered;
        match (&mut self.history, &shown.settings) {
            (None, Some(settings)) => {
                self.edited = Some(settings.clone());
                self.history = Some(History::new(settings.clone()));
            }
            (Some(history), Some(settings)) if is_answer => {
                // What is being changed meanwhile stays.
                if self.edited.as_ref() == Some(history.present()) {
                    self.edited = Some(settings.clone());
                }
                history.settle(settings.clone());
            }
            (_, None) => (self.edited, self.history) = (None, None),
            _ => {}
        }
    }

    fn panel(&mut self, ui: &mut Ui) {
        Panel::bottom("curves").resizable(true).default_size(GRAPHS).show(ui, |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| self.graphs.show(ui));
        });
        let [undo, redo] = self
            .history
            .as_ref()
            .map_or([0; 2], |history| [history.undo_count(), history.redo_count()]);
        let mut view = PanelView {
            name: self.subject.as_ref().map_or("", |subject| &subject.name),
            overlays: &mut self.overlays,
            settings: self.edited.as_mut(),
            backends: &self.backends,
            format: &mut self.clip_format,
            is_recording: self.recording.is_some(),
            undo,
            redo,
        };
        let requests = self.panel.show(ui, &mut view);
        for request in requests {
            self.request(ui.ctx(), request);
        }
        if self.overlays != self.overlays_sent {
            self.overlays_sent = self.overlays;
            self.simulation.send(Command::Overlays(self.overlays));
        }
        // While a number is being dragged it is not asked for: it may take a new solver.
        if let (Some(edited), Some(history)) = (&self.edited, &mut self.history)
            && !ui.ctx().egui_is_using_pointer()
            && history.change(edited.clone())
        {
            self.settings_send(edited.clone());
        }
    }

    /// What was said, and how fast it goes.
    fn status(&mut self, ui: &mut Ui) {
        let speed = self.shown.snapshot.as_ref().map_or(String::new(), speed);
        let recording = self.recording.as_ref().map(Recording::len);
        ui.horizontal_centered(|ui| {
            let width = ui.available_width() - SPEED;
            ui.allocate_ui(egui::vec2(width.max(100.0), ui.available_height()), |ui| {
                ui.set_min_width(width.max(100.0));
                self.messages.bar(ui);
            });
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let error = self.messages.fill(Color32::TRANSPARENT) != Color32::TRANSPARENT;
                let ink = if error { Color32::WHITE } else { ui.visuals().weak_text_color() };
                ui.colored_label(ink, speed);
                if let Some(count) = recording {
                    ui.colored_label(RECORDING, format!("recording, {count} frames"));
                }
            });
        });
    }

    /// Draws the newest frame and shows it.
    fn show_picture(&mut self, ui: &mut Ui) -> Result<(), ViewerError> {
        let rect = ui.available_rect_before_wrap();
        self.picture = rect;
        let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
        let scale = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()].map(|side| (side * scale).round().max(1.0) as u32);
        self.resize(size)?;
        let Some(subject) = &mut self.subject else { return Ok(()) };
        subject.fit(rect.aspect_ratio().into());
        for command in pointer(ui, &response, &mut subject.camera, &mut self.pulled_to) {
            self.simulation.send(command);
        }
        let (Some((target, texture)), Some(snapshot)) = (&self.target, &self.shown.snapshot) else {
            return Ok(());
        };
        let contents = snapshot.contents(self.overlays);
        self.renderer.render(
            target,
            &subject.camera,
            &mut subject.mesh,
            &snapshot.buffers,
            &contents,
        );
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(*texture, rect, whole, Color32::WHITE);
        if let Some(recording) = &mut self.recording
            && !snapshot.is_past
            && recording.wants(snapshot.frame)
        {
            recording.push(snapshot.frame, target.read(&self.gpu)?);
            self.simulation.send(Command::Taken);
        }
        Ok(())
    }

    /// Makes the texture as large as its place in the window.
    fn resize(&mut self, size: [u32; 2]) -> Result<(), ViewerError> {
        if self.target.as_ref().is_some_and(|(target, _)| target.size() == size) {
            return Ok(());
        }
        let target = RenderTarget::new(&self.gpu, size)?;
        let mut renderer = self.render_state.renderer.write();
        let filter = wgpu::FilterMode::Linear;
        let texture = match self.target.take() {
            Some((_, texture)) => {
                renderer.update_egui_texture_from_wgpu_texture(
                    &self.gpu.device,
                    target.view(),
                    filter,
                    texture,
                );
                texture
            }
            None => renderer.register_native_texture(&self.gpu.device, target.view(), filter),
        };
        drop(renderer);
        self.target = Some((target, texture));
        Ok(())
    }

    fn help_window(&mut self, context: &Context) {
        egui::Window::new("keys").open(&mut self.help).show(context, |ui| {
            egui::Grid::new("keys").show(ui, |ui| {
                for (key, text) in keys::help() {
                    ui.strong(key);
                    ui.label(text);
                    ui.end_row();
                }
            });
        });
    }

    fn write_log(&mut self, context: &Context, typing: bool) {
        let widgets = places::take(context);
        if let (Some(log), Some(subject), Some(snapshot)) =
            (&mut self.log, &self.subject, &self.shown.snapshot)
        {
            log.write(
                snapshot,
                &Surroundings {
                    scene: &subject.name,
                    overlays: self.overlays,
                    camera: &subject.camera,
                    fullscreen: is_fullscreen(context),
                    settings: self.shown.settings.as_ref(),
                    widgets: &widgets,
                    typing,
                    pointer: context.input(|input| input.pointer.latest_pos()),
                    pressed: context.input(|input| input.pointer.any_down()),
                    help: self.help,
                    recording: self.recording.is_some(),
                    picture: self.picture,
                    message: self.messages.shown(),
                    undo: self.history.as_ref().map_or(0, History::undo_count),
                    redo: self.history.as_ref().map_or(0, History::redo_count),
                },
            );
        }
    }
}

/// How fast it goes, in words.
fn speed(snapshot: &Snapshot) -> String {
    if snapshot.recorded.is_some() || snapshot.report.substeps == 0 {
        return String::new();
    }
    let ms = snapshot.duration.as_secs_f64() * 1e3;
    match snapshot.paused {
        true => format!("{ms:.1} ms per frame"),
        false => format!("{ms:.1} ms per frame, {:.2} x real time", snapshot.real_time_factor),
    }
}

fn is_fullscreen(context: &Context) -> bool {
    context.input(|input| input.viewport().fullscreen.unwrap_or(false))
}

impl eframe::App for ViewerApp {
    fn ui(&mut self, ui: &mut Ui, _frame: &mut Frame) {
        let context = ui.ctx().clone();
        self.update();
        let typing = context.text_edit_focused();
        for action in context.input(keys::actions) {
            // Letters belong to the line that is typed in, space and arrows to the button that was chosen, a question to its window.
            let is_chosen = matches!(action, Action::Pause | Action::Step | Action::StepBack);
            let is_taken = is_chosen && context.egui_wants_keyboard_input();
            let is_asked = action == Action::Dismiss && self.save.is_open();
            if !typing && !is_taken && !is_asked {
                self.act(&context, action);
            }
        }
        let dropped = context.input(|input| input.raw.dropped_files.first().cloned());
        if let Some(file) = dropped {
            self.open(Source::open_path(file.path()));
        }
        let panel = ui.visuals().panel_fill;
        let frame = egui::Frame::new().inner_margin(Margin::symmetric(8, 0));
        let status = frame.fill(self.messages.fill(panel));
        Panel::bottom("status").exact_size(STATUS).frame(status).show(ui, |ui| self.status(ui));
        Panel::right("panel").default_size(PANEL).min_size(PANEL).show(ui, |ui| self.panel(ui));
        Panel::bottom("timeline").exact_size(TIMELINE).show(ui, |ui| {
            let requests = self.shown.snapshot.as_ref().map(|snapshot| timeline(ui, snapshot));
            for request in requests.into_iter().flatten() {
                self.request(&context, request);
            }
        });
        CentralPanel::no_frame().show(ui, |ui| {
            if let Err(error) = self.show_picture(ui) {
                self.messages.error(&error);
            }
        });
        self.help_window(&context);
        self.messages.window(&context);
        match self.save.show(&context) {
            Some(SaveRequest::Dialog) => self.save_dialog(&context),
            Some(SaveRequest::Save { path, replace }) => {
                self.simulation.send(Command::Save { path, replace });
            }
            None => {}
        }
        self.write_log(&context, typing);
    }

    /// Clips are finished before the program ends.
    fn on_exit(&mut self) {
        let recording = self.recording.take().map(Recording::end);
        for writer in self.writers.drain(..).chain(recording) {
            if writer.join().is_err() {
                self.messages.error(&"a recording ended unexpectedly");
            }
        }
    }
}
