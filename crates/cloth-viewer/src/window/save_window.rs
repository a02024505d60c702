//! Where a scene is to be saved: a path, typed or chosen, and a question before anything is replaced.

use std::path::{Path, PathBuf};

use eframe::egui::{Align2, Context, Key, RichText, TextEdit, Window};

use super::places;

/// The window, while it is open.
#[derive(Default)]
pub(super) struct SaveWindow {
    is_open: bool,
    path: String,
    /// The file that it was asked about, as it exists.
    asked: Option<PathBuf>,
    wants_focus: bool,
}

/// What the window asks for.
#[derive(Debug, PartialEq)]
pub(super) enum SaveRequest {
    /// A dialog that chooses a path.
    Dialog,
    /// To write the file; whether an existing one is to be replaced.
    Save { path: PathBuf, replace: bool },
}

impl SaveWindow {
    /// Opens it with a name that is not taken.
    pub(super) fn open(&mut self, folder: &Path, name: &str) {
        self.path = super::recording::free_path(folder, name, "toml").display().to_string();
        (self.is_open, self.wants_focus, self.asked) = (true, true, None);
    }

    /// Takes over a path that was chosen.
    pub(super) fn choose(&mut self, path: &Path) {
        self.path = with_extension(path).display().to_string();
        (self.is_open, self.asked) = (true, None);
    }

    pub(super) const fn is_open(&self) -> bool {
        self.is_open
    }

    /// Somebody says to save. The answer for a file that exists is a question, until it was answered for this very file.
    fn save(&mut self) -> Option<SaveRequest> {
        let path = with_extension(Path::new(self.path.trim()));
        let replace = path.exists();
        if replace && self.asked.as_ref() != Some(&path) {
            self.asked = Some(path);
            return None;
        }
        self.is_open = false;
        Some(SaveRequest::Save { path, replace })
    }

    pub(super) fn show(&mut self, context: &Context) -> Option<SaveRequest> {
        let mut is_open = self.is_open;
        let mut request = None;
        let window = Window::new("save the scene with these values").open(&mut is_open);
        let window = window.collapsible(false).resizable(false).default_width(440.0);
        window.pivot(Align2::CENTER_CENTER).default_pos(context.content_rect().center()).show(
            context,
            |ui| {
                ui.set_width(440.0);
                let line =
                    ui.add(TextEdit::singleline(&mut self.path).desired_width(f32::INFINITY));
                places::mark("save path", &line);
                if line.changed() {
                    self.asked = None;
                }
                if std::mem::take(&mut self.wants_focus) {
                    line.request_focus();
                }
                let enter = line.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                let question = self.asked.is_some();
                // Always there, so that the buttons stay where they are.
                ui.label(match question {
                    true => RichText::new("This file exists. Replace it?")
                        .color(ui.visuals().warn_fg_color),
                    false => {
                        RichText::new("A scene file; it begins at the start, with these values.")
                            .weak()
                    }
                });
                ui.horizontal(|ui| {
                    let save = ui.button(if question { "replace" } else { "save" });
                    places::mark("save", &save);
                    // Whoever presses Enter twice has not read the question.
                    if save.clicked() || enter && !question {
                        request = self.save();
                    }
                    if ui
                        .button("choose...")
                        .on_hover_text("With the dialog of the desktop")
                        .clicked()
                    {
                        request = Some(SaveRequest::Dialog);
                    }
                    let cancel = ui.button("cancel");
                    places::mark("cancel", &cancel);
                    if cancel.clicked() || ui.input(|input| input.key_pressed(Key::Escape)) {
                        self.is_open = false;
                    }
                });
            },
        );
        self.is_open &= is_open;
        request
    }
}

/// A name without an extension gets that of scene files.
fn with_extension(path: &Path) -> PathBuf {
    match path.extension() {
        Some(_) => path.to_owned(),
        None => path.with_extension("toml"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_exists_is_asked_about_and_only_that_one_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let mut window = SaveWindow::default();
        window.open(folder.path(), "flag");
        let first = folder.path().join("flag-001.toml");
        let new = Some(SaveRequest::Save { path: first.clone(), replace: false });
        assert_eq!((window.save(), window.is_open()), (new, false));

        std::fs::write(&first, "").unwrap();
        let second = folder.path().join("second.toml");
        std::fs::write(&second, "").unwrap();
        window.open(folder.path(), "flag");
        assert_eq!(window.path, folder.path().join("flag-002.toml").display().to_string());
        window.choose(&folder.path().join("flag-001"));
        assert_eq!((window.save(), window.is_open()), (None, true), "it asks");
        // The answer was about another file.
        window.path = second.display().to_string();
        assert_eq!(window.save(), None);
        assert_eq!(window.save(), Some(SaveRequest::Save { path: second, replace: true }));
    }
}
