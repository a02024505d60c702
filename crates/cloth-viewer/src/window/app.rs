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
        self, CentralPanel, Color32, Context, Panel, Pos2, Rect, ScrollArea, Sense, TextureId, Ui,
        ViewportCommand, pos2,
    },
    egui_wgpu::RenderState,
};

use crate::{
    ClipFormat, ClothMesh, Command, Gpu, OrbitCamera, Overlays, RenderTarget, Renderer, Settings,
    Shown, SimulationThread, Source, ViewerError, headless::camera,
};

use super::{
    WindowOptions,
    graphs::Graphs,
    keys::{self, Action},
    panel::{self, PanelRequest},
    places,
    pointer::pointer,
    recording::{Recording, screenshot},
    session_log::{SessionLog, Surroundings},
};

/// What is told to the window from elsewhere.
enum Notice {
    /// A file that was chosen.
    Chosen(PathBuf),
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
    /// The settings in the panel, and those that were asked for last.
    edited: Option<Settings>,
    asked: Option<Settings>,
    backends: Vec<&'static str>,
    graphs: Graphs,
    help: bool,
    pulled_to: Option<Pos2>,
    recording: Option<Recording>,
    clip_format: ClipFormat,
    /// What is being typed to be opened.
    word: String,
    word_focus: bool,
    /// What is still being written.
    writers: Vec<JoinHandle<()>>,
    message: Option<String>,
    message_seen: u64,
    notices: (Sender<Notice>, Receiver<Notice>),
    backend: String,
    folder: PathBuf,
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
        let simulation = SimulationThread::start(
            &gpu,
            options.source,
            &options.backend,
            options.paused,
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
            asked: None,
            backends: cloth::backends().into_iter().map(|info| info.name).collect(),
            graphs: Graphs::default(),
            help: false,
            pulled_to: None,
            recording: None,
            clip_format: ClipFormat::default(),
            word: String::new(),
            word_focus: false,
            writers: Vec::new(),
            message: None,
            message_seen: 0,
            notices: channel(),
            backend: options.backend,
            folder: options.folder,
            log,
        })
    }

    fn act(&mut self, context: &Context, action: Action) {
        match action {
            Action::Pause => self.simulation.send(Command::PauseToggle),
            Action::Step => self.simulation.send(Command::Step),
            Action::Reset => self.simulation.send(Command::Reset),
            Action::Corner(corner) => self.simulation.send(Command::CornerToggle(corner)),
            Action::Wires => self.overlays.wires ^= true,
            Action::Open => self.word_focus = true,
            Action::Help => self.help ^= true,
            Action::Exit => context.send_viewport_cmd(ViewportCommand::Close),
            Action::Fullscreen => {
                context.send_viewport_cmd(ViewportCommand::Fullscreen(!is_fullscreen(context)));
            }
            Action::Screenshot => {
                let taken = self
                    .picture_read()
                    .and_then(|(name, picture)| screenshot(&self.folder, &name, &picture));
                self.message = Some(match taken {
                    Ok(path) => format!("screenshot `{}`", path.display()),
                    Err(error) => error.to_string(),
                });
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
            self.message = Some(format!("writing {} frames", recording.len()));
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
                Err(error) => self.message = Some(error.to_string()),
            }
        }
    }

    fn open(&mut self, source: Result<Source, ViewerError>) {
        match source {
            Ok(source) => self.simulation.send(Command::Open(source, self.backend.clone())),
            Err(error) => self.message = Some(error.to_string()),
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

    fn request(&mut self, context: &Context, request: PanelRequest) {
        match request {
            PanelRequest::Command(command) => self.simulation.send(command),
            PanelRequest::Builtin(name) => self.open(Source::open(name)),
            PanelRequest::Word(word) => self.open(Source::open(&word)),
            PanelRequest::FileDialog => self.dialog(context, false),
            PanelRequest::FolderDialog => self.dialog(context, true),
            PanelRequest::Screenshot => self.act(context, Action::Screenshot),
            PanelRequest::Record => self.act(context, Action::Record),
            PanelRequest::Help => self.act(context, Action::Help),
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
            self.message.clone_from(&shown.message);
            // What was asked for may have been refused.
            self.edited.clone_from(&shown.settings);
            self.asked.clone_from(&shown.settings);
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
            self.graphs.clear();
            self.message = None;
            self.edited = None;
            self.asked = None;
        }
        if self.edited.is_none() {
            self.edited.clone_from(&shown.settings);
            self.asked.clone_from(&shown.settings);
        }
        if let Some(snapshot) = &shown.snapshot {
            self.graphs.push(snapshot);
        }
        self.shown = shown;
        while let Ok(notice) = self.notices.1.try_recv() {
            match notice {
                Notice::Chosen(path) => self.open(Source::open_path(&path)),
                Notice::Say(text) => self.message = Some(text),
                Notice::RecordingFailed(text) => {
                    self.recording = None;
                    self.simulation.send(Command::Record(false));
                    self.message = Some(text);
                }
            }
        }
    }

    fn panel(&mut self, ui: &mut Ui) {
        let mut requests = Vec::new();
        ScrollArea::vertical().show(ui, |ui| {
            let name = self.subject.as_ref().map_or("", |subject| &subject.name);
            requests = panel::open(ui, name, &mut self.word, &mut self.word_focus);
            if let Some(snapshot) = &self.shown.snapshot {
                requests.extend(panel::head(ui, snapshot, &mut self.clip_format));
            }
            if let Some(recording) = &self.recording {
                ui.colored_label(Color32::RED, format!("recording, {} frames", recording.len()));
            }
            if let Some(message) = &self.message {
                ui.label(message);
            }
            ui.separator();
            panel::overlays(ui, &mut self.overlays);
            ui.separator();
            if let Some(edited) = &mut self.edited {
                panel::settings(ui, edited, &self.backends);
            }
            ui.separator();
            self.graphs.show(ui);
        });
        for request in requests {
            self.request(ui.ctx(), request);
        }
        if self.overlays != self.overlays_sent {
            self.overlays_sent = self.overlays;
            self.simulation.send(Command::Overlays(self.overlays));
        }
        // While a number is being dragged it is not asked for: it may take a new solver.
        if self.edited != self.asked && !ui.ctx().egui_is_using_pointer() {
            self.asked.clone_from(&self.edited);
            if let Some(settings) = &self.asked {
                self.simulation.send(Command::Settings(settings.clone()));
            }
        }
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
                    help: self.help,
                    recording: self.recording.is_some(),
                    picture: self.picture,
                    message: self.message.as_deref(),
                },
            );
        }
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
            // Letters belong to the line that is typed in, and space to the button that was chosen.
            let is_taken = action == Action::Step && context.egui_wants_keyboard_input();
            if !typing && !is_taken {
                self.act(&context, action);
            }
        }
        let dropped = context.input(|input| input.raw.dropped_files.first().cloned());
        if let Some(file) = dropped {
            self.open(Source::open_path(file.path()));
        }
        Panel::right("panel").default_size(300.0).show(ui, |ui| self.panel(ui));
        CentralPanel::no_frame().show(ui, |ui| {
            if let Err(error) = self.show_picture(ui) {
                self.message = Some(error.to_string());
            }
        });
        self.help_window(&context);
        self.write_log(&context, typing);
    }

    /// Clips are finished before the program ends.
    fn on_exit(&mut self) {
        let recording = self.recording.take().map(Recording::end);
        for writer in self.writers.drain(..).chain(recording) {
            if writer.join().is_err() {
                eprintln!("error: a recording ended unexpectedly");
            }
        }
    }
}
