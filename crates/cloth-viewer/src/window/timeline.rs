//! The bar below the picture: play, pause, and the frames that can be gone back to.

use eframe::egui::{Align, Color32, Label, Layout, RichText, Slider, Ui};

use super::{
    icons::{Icon, icon_button},
    panel::PanelRequest,
    places,
};
use crate::{Command, KeptView, Snapshot};

/// Width of the number of the frame \[point\].
const FRAME: f32 = 150.0;
/// What is said of the past.
const PAST: Color32 = Color32::from_rgb(240, 200, 70);

/// What the bar says.
#[derive(Debug, PartialEq)]
struct View {
    /// The frames that can be shown.
    range: [u64; 2],
    /// What is kept, in words.
    kept: String,
    /// Whether an earlier frame than the present one is shown.
    is_past: bool,
}

impl View {
    fn of(frame: u64, recorded: Option<usize>, kept: Option<KeptView>, is_past: bool) -> Self {
        if let Some(count) = recorded {
            let kept = format!("{count} recorded frames");
            return Self { range: [0, (count as u64).saturating_sub(1)], kept, is_past: false };
        }
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let (range, kept) = match kept {
            Some(KeptView { range: Some([first, last]), bytes, budget }) => {
                let used = mebibytes(bytes);
                let kept = format!(
                    "frames {first} to {last} kept: {used:.1} of {:.0} MiB",
                    mebibytes(budget)
                );
                ([first, last], kept)
            }
            Some(KeptView { budget, .. }) => {
                let budget = mebibytes(budget);
                ([frame; 2], format!("no frames kept: one is more than {budget:.0} MiB"))
            }
            None => ([frame; 2], String::new()),
        };
        Self { range, kept, is_past }
    }
}

/// The bar, and what it asks for.
pub(super) fn timeline(ui: &mut Ui, snapshot: &Snapshot) -> Vec<PanelRequest> {
    let Snapshot { frame, time, paused, recorded, kept, is_past, .. } = *snapshot;
    let view = View::of(frame, recorded, kept, is_past);
    let mut requests = Vec::new();
    let mut ask = |command| requests.push(PanelRequest::Command(Box::new(command)));
    ui.horizontal(|ui| {
        let play =
            if paused { (Icon::Play, "Play (space)") } else { (Icon::Pause, "Pause (space)") };
        for (name, (icon, tip), command) in [
            ("reset", (Icon::Start, "Back to the start (R)"), Command::Reset),
            ("step back", (Icon::Back, "The frame before (left arrow)"), Command::StepBack),
            ("play", play, Command::PauseToggle),
            ("step", (Icon::Next, "The next frame (right arrow)"), Command::Step),
        ] {
            let response = icon_button(ui, icon);
            places::mark(name, &response);
            if response.on_hover_text(tip).clicked() {
                ask(command);
            }
        }
        ui.spacing_mut().slider_width = (ui.available_width() - FRAME - 16.0).max(40.0);
        let mut shown = frame;
        let slider = Slider::new(&mut shown, view.range[0]..=view.range[1].max(view.range[0]));
        let slider = slider.show_value(false).trailing_fill(true);
        let response = ui.add_enabled(view.range[0] < view.range[1], slider);
        places::mark("frame", &response);
        if response
            .on_hover_text("Look at an earlier frame; the simulation stays where it is")
            .changed()
        {
            ask(Command::Seek(shown));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.monospace(format!("{time:.3} s"));
            ui.strong(format!("frame {frame}"));
        });
    });
    ui.horizontal(|ui| {
        ui.add_enabled_ui(view.is_past, |ui| {
            let response = ui.button("go on from here");
            places::mark("go on from here", &response);
            let tip = "Play on from the frame that is shown, and forget what came after it";
            if response.on_hover_text(tip).clicked() {
                ask(Command::GoOnFromHere);
            }
        });
        let text = if view.is_past {
            RichText::new(format!("the past; space plays on from frame {}", view.range[1]))
                .color(PAST)
        } else {
            RichText::new(view.kept).weak()
        };
        ui.add(Label::new(text).truncate().selectable(false));
    });
    requests
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_covers_what_can_be_shown_and_says_its_budget() {
        let kept = KeptView { range: Some([7, 40]), bytes: 3 << 19, budget: 256 << 20 };
        let view = View::of(40, None, Some(kept), false);
        assert_eq!(view.range, [7, 40]);
        assert_eq!(view.kept, "frames 7 to 40 kept: 1.5 of 256 MiB");
        let nothing = KeptView { range: None, bytes: 0, budget: 1 << 20 };
        let view = View::of(40, None, Some(nothing), false);
        assert_eq!((view.range, &*view.kept), ([40, 40], "no frames kept: one is more than 1 MiB"));
        assert_eq!(View::of(3, Some(6), None, false).range, [0, 5]);
        assert_eq!(View::of(0, Some(0), None, false).range, [0, 0]);
        assert!(View::of(12, None, Some(kept), true).is_past);
    }
}
