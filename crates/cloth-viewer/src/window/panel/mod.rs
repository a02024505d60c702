//! The panel beside the picture.

use cloth::{
    LinearMethod, Preconditioner,
    scene::{SceneSolver, builtin_scenes},
};
use eframe::egui::{self, ComboBox, DragValue, Key, Slider, TextEdit, Ui};

use super::places;
use crate::{ClipFormat, Command, Overlays, Settings, Snapshot};

/// What the panel asks for.
pub(super) enum PanelRequest {
    Command(Command),
    /// A built-in scene by its name.
    Builtin(&'static str),
    /// What was typed, as in [`Source::open`](crate::Source::open).
    Word(String),
    FileDialog,
    FolderDialog,
    Screenshot,
    Record,
    Help,
    View,
}

/// What to open.
pub(super) fn open(
    ui: &mut Ui,
    name: &str,
    word: &mut String,
    focus: &mut bool,
) -> Vec<PanelRequest> {
    let mut requests = Vec::new();
    ui.heading(name);
    ui.horizontal(|ui| {
        ui.menu_button("open", |ui| {
            for builtin in builtin_scenes() {
                if ui.button(builtin.name).on_hover_text(builtin.summary).clicked() {
                    requests.push(PanelRequest::Builtin(builtin.name));
                    ui.close();
                }
            }
            ui.separator();
            if ui.button("file...").clicked() {
                requests.push(PanelRequest::FileDialog);
                ui.close();
            }
            if ui.button("folder of a run...").clicked() {
                requests.push(PanelRequest::FolderDialog);
                ui.close();
            }
        });
        // Some systems have no dialog.
        let line = TextEdit::singleline(word).hint_text("scene, run, frames (O)");
        let response = ui.add(line.desired_width(f32::INFINITY));
        // From the next picture on, so that the key that asked for it is no letter.
        if std::mem::take(focus) {
            response.request_focus();
        }
        if response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter)) {
            requests.push(PanelRequest::Word(std::mem::take(word)));
        }
    });
    requests
}

/// The buttons, and the state of the scene in words.
pub(super) fn head(ui: &mut Ui, snapshot: &Snapshot, format: &mut ClipFormat) -> Vec<PanelRequest> {
    let mut requests = Vec::new();
    ui.horizontal(|ui| {
        let label = if snapshot.paused { "go on (P)" } else { "pause (P)" };
        for (text, request) in [
            (label, PanelRequest::Command(Command::PauseToggle)),
            ("step", PanelRequest::Command(Command::Step)),
            ("reset (R)", PanelRequest::Command(Command::Reset)),
            ("view", PanelRequest::View),
            ("keys (H)", PanelRequest::Help),
        ] {
            if ui.button(text).clicked() {
                requests.push(request);
            }
        }
    });
    ui.horizontal(|ui| {
        if ui.button("screenshot (S)").clicked() {
            requests.push(PanelRequest::Screenshot);
        }
        if ui.button("record (V)").clicked() {
            requests.push(PanelRequest::Record);
        }
        for choice in ClipFormat::ALL {
            ui.selectable_value(format, choice, choice.extension());
        }
    });
    match snapshot.recorded {
        Some(count) => {
            let mut index = snapshot.frame as usize;
            let slider = Slider::new(&mut index, 0..=count.saturating_sub(1)).text("frame");
            let response = ui.add(slider);
            places::mark("frame", &response);
            if response.changed() {
                requests.push(PanelRequest::Command(Command::Seek(index)));
            }
            ui.label(format!("t = {:.3} s, recorded", snapshot.time));
        }
        None => {
            ui.label(format!("frame {}, t = {:.3} s", snapshot.frame, snapshot.time));
            ui.label(format!(
                "{:.2} ms per frame, {:.2} x real time",
                snapshot.duration.as_secs_f64() * 1e3,
                snapshot.real_time_factor
            ));
        }
    }
    requests
}

/// What is drawn.
pub(super) fn overlays(ui: &mut Ui, overlays: &mut Overlays) {
    ui.checkbox(&mut overlays.surface, "surface");
    ui.checkbox(&mut overlays.wires, "wireframe (W)");
    ui.horizontal(|ui| {
        ui.label("springs");
        for (slot, name) in ["stretch", "shear", "bend"].into_iter().enumerate() {
            ui.checkbox(&mut overlays.springs[slot], name);
        }
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut overlays.strain, "strain, red at");
        let scale = DragValue::new(&mut overlays.strain_scale);
        ui.add(scale.range(0.001..=10.0).speed(0.005).custom_formatter(|v, _| format!("{v:.3}")));
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut overlays.pins, "pins");
        ui.checkbox(&mut overlays.contacts, "contacts");
        ui.checkbox(&mut overlays.bins, "bins");
    });
}

/// The settings of the simulation.
pub(super) fn settings(ui: &mut Ui, settings: &mut Settings, backends: &[&'static str]) {
    choice(ui, "backend", &mut settings.backend, backends.iter().map(|&name| (name.into(), name)));
    if settings.backend == "wgpu" {
        ui.checkbox(&mut settings.stage_times, "time of every stage")
            .on_hover_text("the program then waits for the device to give them, which costs speed");
    }
    let solver = settings.solver;
    let solvers = SceneSolver::ALL.iter().map(|&solver| (solver, solver.name()));
    choice(ui, "integrator", &mut settings.solver, solvers);
    if solver != settings.solver {
        // A step that suits one suits no other.
        settings.time_step = match settings.solver {
            SceneSolver::Explicit => 1e-3,
            _ => 1.0 / 60.0,
        };
    }
    if settings.solver == SceneSolver::Implicit {
        let methods = LinearMethod::ALL.iter().map(|&method| (method, method.name()));
        choice(ui, "linear solver", &mut settings.linear, methods);
        if settings.linear == LinearMethod::ConjugateGradient {
            let all = Preconditioner::ALL.iter().map(|&one| (one, one.name()));
            choice(ui, "preconditioner", &mut settings.preconditioner, all);
        }
        number(ui, "iterations", DragValue::new(&mut settings.iterations).range(1..=10_000));
    }
    let mut milliseconds = settings.time_step * 1e3;
    let step = DragValue::new(&mut milliseconds).range(0.01..=100.0).speed(0.02).suffix(" ms");
    if number(ui, "time step", step) {
        settings.time_step = milliseconds * 1e-3;
    }
    let names = ["stiffness, stretch", "stiffness, shear", "stiffness, bend"];
    for (slot, name) in names.into_iter().enumerate() {
        number(ui, name, factor(DragValue::new(&mut settings.stiffness[slot])));
    }
    number(ui, "damping", factor(DragValue::new(&mut settings.damping)));
    ui.horizontal(|ui| {
        ui.label("wind [m/s]");
        for velocity in &mut settings.wind {
            let response = ui.add(DragValue::new(velocity).range(-50.0..=50.0).speed(0.1));
            places::mark("wind", &response);
        }
    });
    let mut touches = settings.contact.is_some();
    let mut distance = settings.contact.unwrap_or(0.01) * 1e3;
    ui.horizontal(|ui| {
        ui.checkbox(&mut touches, "self-contact");
        let value = DragValue::new(&mut distance).range(0.1..=1000.0).speed(0.1).suffix(" mm");
        ui.add_enabled(touches, value);
    });
    let changed = (distance * 1e-3 - settings.contact.unwrap_or(0.01)).abs() > 1e-9;
    if touches != settings.contact.is_some() || touches && changed {
        settings.contact = touches.then_some(distance * 1e-3);
    }
}

fn factor(value: DragValue<'_>) -> DragValue<'_> {
    value.range(0.001..=1000.0).speed(0.01).prefix("x ")
}

fn number(ui: &mut Ui, label: &'static str, value: DragValue<'_>) -> bool {
    ui.horizontal(|ui| {
        ui.label(label);
        let response = ui.add(value);
        places::mark(label, &response);
        response.changed()
    })
    .inner
}

fn choice<T: PartialEq>(
    ui: &mut Ui,
    label: &str,
    value: &mut T,
    all: impl Iterator<Item = (T, &'static str)>,
) {
    let all: Vec<(T, &'static str)> = all.collect();
    let name = all.iter().find(|(one, _)| one == value).map_or("", |(_, name)| name);
    ComboBox::from_label(label).selected_text(name).show_ui(ui, |ui: &mut egui::Ui| {
        for (one, name) in all {
            ui.selectable_value(value, one, name);
        }
    });
}
