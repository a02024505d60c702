//! Figures of the last frames as curves.

use std::collections::VecDeque;

use eframe::egui::{Color32, Ui};
use egui_plot::{Line, Plot};

use crate::Snapshot;

/// Frames that are kept.
const LENGTH: usize = 300;
/// Stages that get a curve of their own.
const STAGES: usize = 5;

/// Colours of curves; no plot has more.
const COLOURS: [Color32; STAGES + 1] = [
    Color32::from_rgb(235, 235, 235),
    Color32::from_rgb(240, 120, 70),
    Color32::from_rgb(90, 170, 250),
    Color32::from_rgb(110, 210, 110),
    Color32::from_rgb(240, 200, 70),
    Color32::from_rgb(200, 130, 230),
];

/// Figures of one frame.
struct Point {
    frame: f64,
    /// Time of the frame and of its stages \[ms\].
    total: f64,
    stages: Vec<(&'static str, f64)>,
    iterations: f64,
    residual: f64,
    energies: [f64; 3],
    strain: f64,
}

/// The last frames.
#[derive(Default)]
pub(super) struct Graphs {
    points: VecDeque<Point>,
}

impl Graphs {
    pub(super) fn clear(&mut self) {
        self.points.clear();
    }

    /// Adds a frame, unless it is there.
    pub(super) fn push(&mut self, snapshot: &Snapshot) {
        let frame = snapshot.frame as f64;
        if snapshot.report.substeps == 0 {
            // Nothing was computed and nothing measured.
            if self.points.back().is_some_and(|last| last.frame > frame) {
                self.points.clear();
            }
            return;
        }
        match self.points.back() {
            Some(last) if last.frame == frame => return,
            // After a reset the curves begin anew.
            Some(last) if last.frame > frame => self.points.clear(),
            _ => {}
        }
        let report = &snapshot.report;
        let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3;
        let measures = &report.measures;
        self.points.push_back(Point {
            frame,
            total: ms(snapshot.duration),
            stages: report.stage_times.iter().map(|stage| (stage.stage, ms(stage.time))).collect(),
            iterations: report.solver.iterations as f64,
            residual: report.solver.residual,
            energies: [measures.energy_kinetic, measures.energy_elastic, measures.energy_potential],
            strain: measures.strain_max,
        });
        if self.points.len() > LENGTH {
            self.points.pop_front();
        }
    }

    pub(super) fn show(&self, ui: &mut Ui) {
        if self.points.is_empty() {
            return;
        }
        let stages = self.largest_stages();
        let mut times: Vec<(&str, Vec<[f64; 2]>)> = vec![("frame", self.curve(|p| p.total))];
        times.extend(stages.into_iter().map(|name| {
            let of_stage = |p: &Point| {
                p.stages.iter().find(|(stage, _)| *stage == name).map_or(0.0, |(_, time)| *time)
            };
            (name, self.curve(of_stage))
        }));
        plot(ui, "time [ms]", times);
        if self.points.iter().any(|point| point.iterations > 0.0) {
            plot(ui, "linear solver", vec![("iterations", self.curve(|p| p.iterations))]);
            let residual = self.curve(|p| p.residual.max(1e-16).log10());
            plot(ui, "residual", vec![("log10", residual)]);
        }
        plot(
            ui,
            "energy [J]",
            vec![
                ("kinetic", self.curve(|p| p.energies[0])),
                ("elastic", self.curve(|p| p.energies[1])),
                ("potential", self.curve(|p| p.energies[2])),
            ],
        );
        plot(ui, "strain [%]", vec![("largest", self.curve(|p| 100.0 * p.strain))]);
    }

    fn curve(&self, value: impl Fn(&Point) -> f64) -> Vec<[f64; 2]> {
        self.points.iter().map(|point| [point.frame, value(point)]).collect()
    }

    /// The stages that took longest in the last frame.
    fn largest_stages(&self) -> Vec<&'static str> {
        let mut stages = self.points.back().map(|point| point.stages.clone()).unwrap_or_default();
        stages.sort_by(|a, b| b.1.total_cmp(&a.1));
        stages.into_iter().take(STAGES).map(|(name, _)| name).collect()
    }
}

/// Curves below a line that says which is which, and the last value of each.
fn plot(ui: &mut Ui, title: &str, curves: Vec<(&str, Vec<[f64; 2]>)>) {
    ui.horizontal_wrapped(|ui| {
        ui.strong(title);
        for ((name, points), colour) in curves.iter().zip(COLOURS) {
            let value = points.last().map_or(0.0, |point| point[1]);
            // A stage is written as people write, in one piece.
            let text = format!("{name} {}", short(value)).replace(['_', ' '], "\u{a0}");
            ui.colored_label(colour, text);
        }
    });
    Plot::new(title).height(64.0).allow_drag(false).allow_zoom(false).allow_scroll(false).show(
        ui,
        |plot| {
            for ((name, points), colour) in curves.into_iter().zip(COLOURS) {
                plot.line(Line::new(name, points).color(colour));
            }
        },
    );
}

/// Three figures or so.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if !(1e-3..1e5).contains(&size) => format!("{value:.1e}"),
        size if size < 1.0 => format!("{value:.3}"),
        size if size < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short() {
        for (value, text) in
            [(0.0, "0"), (3.0e-5, "3.0e-5"), (0.1234, "0.123"), (12.34, "12.3"), (-1234.5, "-1234")]
        {
            assert_eq!(short(value), text);
        }
    }
}
