//! The panel beside the picture: what is open, and four pages of what can be changed.

mod cloth_page;
mod solver_page;
mod view_page;
mod world_page;

use cloth::scene::builtin_scenes;
use eframe::egui::{
    Align, Button, ComboBox, Key, Label, Layout, RichText, ScrollArea, TextEdit, TextStyle, Ui,
    vec2,
};

use super::{
    parameters::{self, VALUE},
    places,
};
use crate::{ClipFormat, Command, Overlays, Settings};

/// What the panel asks for.
pub(super) enum PanelRequest {
    Command(Box<Command>),
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
    Undo,
    Redo,
    Save,
}

/// The page that is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Page {
    View,
    #[default]
    Cloth,
    World,
    Solver,
}

const PAGES: [(Page, &str, &str); 4] = [
    (Page::View, "View", "What is drawn; pictures and recordings"),
    (Page::Cloth, "Cloth", "What each cloth is made of"),
    (Page::World, "World", "Gravity, air, contact, friction"),
    (Page::Solver, "Solver", "What computes, and how finely"),
];

/// What the panel remembers.
#[derive(Default)]
pub(super) struct PanelState {
    page: Page,
    /// The cloth whose values are shown.
    cloth: usize,
    /// What is being typed to be opened.
    word: String,
    pub(super) word_focus: bool,
}

/// What the panel shows and changes.
pub(super) struct PanelView<'a> {
    /// Name of the scene.
    pub(super) name: &'a str,
    pub(super) overlays: &'a mut Overlays,
    /// None for recorded frames.
    pub(super) settings: Option<&'a mut Settings>,
    pub(super) backends: &'a [&'static str],
    pub(super) format: &'a mut ClipFormat,
    pub(super) is_recording: bool,
    /// Changes that can be taken back, and made again.
    pub(super) undo: usize,
    pub(super) redo: usize,
}

impl PanelState {
    /// The head of the panel and the page that is chosen.
    pub(super) fn show(&mut self, ui: &mut Ui, view: &mut PanelView<'_>) -> Vec<PanelRequest> {
        let mut requests = Vec::new();
        ui.add_space(4.0);
        self.head(ui, view, &mut requests);
        self.open(ui, &mut requests);
        ui.add_space(2.0);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let width = (ui.available_width() - 12.0) / 4.0;
            for (page, name, tip) in PAGES {
                let button = Button::selectable(self.page == page, name);
                let response = ui.add_sized(vec2(width, 24.0), button);
                places::mark(name, &response);
                if response.on_hover_text(tip).clicked() {
                    self.page = page;
                }
            }
        });
        ui.separator();
        let scroll = ScrollArea::vertical().id_salt(self.page as u8).auto_shrink(false);
        scroll.show(ui, |ui| match (self.page, &mut view.settings) {
            (Page::View, _) => requests.extend(view_page::show(ui, view)),
            (_, None) => {
                ui.weak("Recorded frames have no values to change.");
            }
            (Page::Cloth, Some(settings)) => cloth_page::show(ui, &mut self.cloth, settings),
            (Page::World, Some(settings)) => world_page::show(ui, settings),
            (Page::Solver, Some(settings)) => solver_page::show(ui, settings, view.backends),
        });
        requests
    }

    /// The name of the scene; undo, redo, save, help.
    fn head(&self, ui: &mut Ui, view: &PanelView<'_>, requests: &mut Vec<PanelRequest>) {
        ui.horizontal(|ui| {
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let is_live = view.settings.is_some();
                let tips = [
                    "Keys (H)".to_owned(),
                    "Save the scene with these values as TOML (ctrl + S)".to_owned(),
                    format!("Change again: {} changes (ctrl + shift + Z)", view.redo),
                    format!("Take a change back: {} changes (ctrl + Z)", view.undo),
                ];
                for ((name, text, is_on, request), tip) in [
                    ("keys", "?", true, PanelRequest::Help),
                    ("save scene", "save", is_live, PanelRequest::Save),
                    ("redo", "redo", view.redo > 0, PanelRequest::Redo),
                    ("undo", "undo", view.undo > 0, PanelRequest::Undo),
                ]
                .into_iter()
                .zip(tips)
                {
                    let button = Button::new(text).min_size(vec2(26.0, 24.0));
                    let response = ui.add_enabled(is_on, button);
                    places::mark(name, &response);
                    if response.on_hover_text(&tip).on_disabled_hover_text(&tip).clicked() {
                        requests.push(request);
                    }
                }
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let name = RichText::new(view.name).text_style(TextStyle::Heading).strong();
                    ui.add(Label::new(name).truncate());
                });
            });
        });
    }

    /// What to open.
    fn open(&mut self, ui: &mut Ui, requests: &mut Vec<PanelRequest>) {
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
            let line = TextEdit::singleline(&mut self.word).hint_text("scene, run, frames (O)");
            let response = ui.add(line.desired_width(f32::INFINITY));
            // From the next picture on, so that the key that asked for it is no letter.
            if std::mem::take(&mut self.word_focus) {
                response.request_focus();
            }
            if response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter)) {
                requests.push(PanelRequest::Word(std::mem::take(&mut self.word)));
            }
        });
    }
}

/// A heading within a page.
fn heading(ui: &mut Ui, text: &str) {
    ui.add_space(6.0);
    ui.label(RichText::new(text).strong());
}

/// A row with a box to tick.
fn tick(ui: &mut Ui, label: &'static str, tip: &str, key: &str, is_on: &mut bool) -> bool {
    let response = ui.checkbox(is_on, label);
    places::mark(label, &response);
    response.on_hover_text(format!("{tip}\nScene key: {key}")).changed()
}

/// A row with a choice of names.
fn choice<T: PartialEq>(
    ui: &mut Ui,
    label: &'static str,
    tooltip: &str,
    value: &mut T,
    all: impl Iterator<Item = (T, &'static str)>,
) {
    let all: Vec<(T, &'static str)> = all.collect();
    let name = all.iter().find(|(one, _)| one == value).map_or("", |(_, name)| name);
    parameters::row(ui, label, tooltip, |ui| {
        let chosen = ComboBox::from_id_salt(label).width(VALUE).truncate().selected_text(name);
        let response = chosen.show_ui(ui, |ui| {
            for (one, name) in all {
                ui.selectable_value(value, one, name);
            }
        });
        places::mark(label, &response.response);
        response.response.on_hover_text(tooltip);
    });
}
