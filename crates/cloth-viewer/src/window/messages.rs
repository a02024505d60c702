//! What was said, in a place of its own, so that nothing moves when something is said.

use std::collections::VecDeque;

use eframe::egui::{
    Align, Color32, Context, Label, Layout, RichText, ScrollArea, Sense, TextStyle, Ui, Window,
};

use super::places;
use crate::{Listener, Message, Severity};

/// Messages that can be read again.
const LENGTH: usize = 100;
/// Behind an error, and the words on it.
const ERROR_FILL: Color32 = Color32::from_rgb(150, 28, 28);
const ERROR_TEXT: Color32 = Color32::from_rgb(255, 238, 236);
/// An error on the colour of a panel.
const ERROR_INK: Color32 = Color32::from_rgb(255, 128, 120);

/// All messages.
#[derive(Default)]
pub(super) struct Messages {
    all: VecDeque<Message>,
    /// Whether the last one is shown.
    is_shown: bool,
    /// Whether all are shown.
    is_open: bool,
    listener: Listener,
}

impl Messages {
    /// No messages yet; `listener` is told each.
    pub(super) fn new(listener: Listener) -> Self {
        Self { listener, ..Self::default() }
    }

    pub(super) fn say(&mut self, message: Message) {
        // What goes wrong in every picture is said once.
        if self.shown() == Some(&message) {
            return;
        }
        self.listener.tell(&message);
        self.all.push_back(message);
        self.is_shown = true;
        if self.all.len() > LENGTH {
            self.all.pop_front();
        }
    }

    pub(super) fn info(&mut self, text: impl Into<String>) {
        self.say(Message::info(text));
    }

    pub(super) fn error(&mut self, error: &impl ToString) {
        self.say(Message::error(error));
    }

    /// No message is shown any more; it can be read again.
    pub(super) const fn dismiss(&mut self) {
        self.is_shown = false;
    }

    /// The message that is shown.
    pub(super) fn shown(&self) -> Option<&Message> {
        self.all.back().filter(|_| self.is_shown)
    }

    /// Colour of the bar at the bottom.
    pub(super) fn fill(&self, panel: Color32) -> Color32 {
        match self.shown() {
            Some(Message { severity: Severity::Error, .. }) => ERROR_FILL,
            _ => panel,
        }
    }

    /// The message in one line, which is cut if it is too long; the whole when the pointer is on it, all messages at a click.
    pub(super) fn bar(&mut self, ui: &mut Ui) {
        let Some(message) = self.shown().cloned() else {
            ui.weak(if self.all.is_empty() { "ready" } else { "" });
            return;
        };
        let is_error = message.severity == Severity::Error;
        let ink = if is_error { ERROR_TEXT } else { ui.visuals().text_color() };
        let text = if is_error { format!("Error: {}", message.text) } else { message.text.clone() };
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let close =
                ui.add(Label::new(RichText::new("×").size(18.0).color(ink)).sense(Sense::click()));
            places::mark("dismiss", &close);
            if close.on_hover_text("Put this message away (Esc)").clicked() {
                self.dismiss();
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let label = Label::new(RichText::new(text).color(ink)).truncate();
                let response = ui.add(label.selectable(false).sense(Sense::click()));
                places::mark("message", &response);
                if response.on_hover_text(&message.text).clicked() {
                    self.is_open ^= true;
                }
            });
        });
    }

    /// The window with all messages, while it is open.
    pub(super) fn window(&mut self, context: &Context) {
        let mut is_open = self.is_open;
        Window::new("messages").open(&mut is_open).default_width(520.0).show(context, |ui| {
            ScrollArea::vertical().max_height(320.0).stick_to_bottom(true).show(ui, |ui| {
                ui.set_min_width(ui.available_width());
                for message in &self.all {
                    let text = RichText::new(&message.text).text_style(TextStyle::Body);
                    let text = match message.severity {
                        Severity::Error => text.color(ERROR_INK),
                        Severity::Info => text,
                    };
                    ui.add(Label::new(text).wrap());
                }
            });
        });
        self.is_open = is_open;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_has_a_colour_of_its_own_until_it_is_put_away() {
        let panel = Color32::from_gray(27);
        let heard = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
        let hearing = heard.clone();
        let listener = Listener::new(move |message| hearing.lock().unwrap().push(message.clone()));
        let mut messages = Messages::new(listener);
        assert_eq!((messages.shown(), messages.fill(panel)), (None, panel));
        messages.error(&"broken");
        assert_eq!(messages.fill(panel), ERROR_FILL);
        messages.info("saved");
        assert_eq!(messages.fill(panel), panel);
        messages.error(&"broken");
        messages.dismiss();
        assert_eq!((messages.shown(), messages.fill(panel)), (None, panel));
        // The same again is seen again.
        messages.error(&"broken");
        assert_eq!(messages.shown().unwrap().text, "broken");
        let heard: Vec<String> = heard.lock().unwrap().iter().map(|m| m.text.clone()).collect();
        assert_eq!(heard, ["broken", "saved", "broken", "broken"]);
        (0..1000).for_each(|number| messages.info(number.to_string()));
        assert_eq!(messages.all.len(), LENGTH);
    }
}
