//! Figures of the last frames as curves.

use std::collections::VecDeque;

use eframe::egui::{Color32, Label, RichText, Ui, vec2};
use egui_plot::{Line, Plot, VLine};

use super::{
    colours::{CURVES, FRAME, stage_colour},
    parameters::figures,
};
use crate::Snapshot;

/// Frames that are kept.
const LENGTH: usize = 300;
/// Stages that get a curve of their own.
const STAGES: usize = 5;

/// Size of the letters of names \[point\].
const LEGEND: f32 = 11.0;

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
    /// The frame of the past that is shown, if one is.
    marked: Option<f64>,
}

impl Graphs {
    pub(super) fn clear(&mut self) {
        self.points.clear();
    }

    /// Adds a frame, unless it is there; one of the past is marked in the curves.
    pub(super) fn push(&mut self, snapshot: &Snapshot) {
        let frame = snapshot.frame as f64;
        self.marked = snapshot.is_past.then_some(frame);
        if snapshot.is_past {
            return;
        }
        // What came after a frame from which the simulation goes on anew is no more.
        while self.points.back().is_some_and(|last| last.frame > frame) {
            self.points.pop_back();
        }
        let is_there = self.points.back().is_some_and(|last| last.frame == frame);
        // At the start nothing was computed and nothing measured.
        if is_there || snapshot.report.substeps == 0 {
            return;
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
        let curve = |name: &'static str, colour, points| Curve { name, colour, points };
        let mut times = vec![curve("frame", FRAME, self.curve(|point| point.total))];
        times.extend(self.largest_stages().into_iter().map(|name| {
            let of_stage = |point: &Point| point.stage(name);
            curve(name, stage_colour(name), self.curve(of_stage))
        }));
        let [white, orange, blue] = CURVES;
        self.plot(ui, "time", "ms", STAGES + 1, times);
        let energy = |slot: usize| self.curve(move |point| point.energies[slot]);
        let energies = vec![
            curve("kinetic", white, energy(0)),
            curve("elastic", orange, energy(1)),
            curve("potential", blue, energy(2)),
        ];
        self.plot(ui, "energy", "J", 3, energies);
        let strain = self.curve(|point| 100.0 * point.strain);
        self.plot(ui, "strain", "%", 1, vec![curve("largest", white, strain)]);
        let iterations = self.curve(|point| point.iterations);
        self.plot(ui, "linear solver", "", 1, vec![curve("iterations", white, iterations)]);
        let residual = self.curve(|point| point.residual.max(1e-16).log10());
        self.plot(ui, "residual", "", 1, vec![curve("log10", white, residual)]);
    }

    fn curve(&self, value: impl Fn(&Point) -> f64) -> Vec<[f64; 2]> {
        self.points.iter().map(|point| [point.frame, value(point)]).collect()
    }

    /// The stages that took longest in all frames together, in the order of their names: both change rarely.
    fn largest_stages(&self) -> Vec<&'static str> {
        let mut totals: Vec<(&'static str, f64)> = Vec::new();
        for (name, time) in self.points.iter().flat_map(|point| &point.stages) {
            match totals.iter_mut().find(|(known, _)| known == name) {
                Some((_, total)) => *total += time,
                None => totals.push((name, *time)),
            }
        }
        totals.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(b.0)));
        let mut names: Vec<_> = totals.into_iter().take(STAGES).map(|(name, _)| name).collect();
        names.sort_unstable();
        names
    }

    /// Curves below a list of their names and last values, which has room for `rows` of them.
    fn plot(&self, ui: &mut Ui, title: &str, unit: &str, rows: usize, curves: Vec<Curve>) {
        let head = if unit.is_empty() { title.to_owned() } else { format!("{title} [{unit}]") };
        ui.label(RichText::new(head).strong());
        let height = LEGEND + 4.0;
        let width = ui.available_width() / 2.0 - 6.0;
        for row in 0..rows.div_ceil(2) {
            ui.horizontal(|ui| {
                ui.set_height(height);
                ui.spacing_mut().item_spacing.x = 4.0;
                for curve in curves.iter().skip(2 * row).take(2) {
                    let value = curve.points.last().map_or(0.0, |point| point[1]);
                    let name = curve.name.replace('_', " ");
                    let text = RichText::new(format!("{} {name}", short(value))).size(LEGEND);
                    let label = Label::new(text.color(curve.colour)).truncate().selectable(false);
                    ui.allocate_ui(vec2(width, height), |ui| {
                        ui.set_min_width(width);
                        ui.add(label);
                    });
                }
            });
        }
        let plot = Plot::new(title).height(64.0).show_x(false).y_axis_min_width(32.0);
        let plot = plot.allow_drag(false).allow_zoom(false).allow_scroll(false);
        plot.show_axes([false, true]).show(ui, |plot| {
            for Curve { name, colour, points } in curves {
                plot.line(Line::new(name, points).color(colour));
            }
            if let Some(frame) = self.marked {
                plot.vline(VLine::new("shown", frame).color(Color32::from_gray(150)));
            }
        });
        ui.add_space(4.0);
    }
}

/// A curve with its name.
struct Curve {
    name: &'static str,
    colour: Color32,
    points: Vec<[f64; 2]>,
}

impl Point {
    /// Time of a stage \[ms\].
    fn stage(&self, name: &str) -> f64 {
        self.stages.iter().find(|(stage, _)| *stage == name).map_or(0.0, |(_, time)| *time)
    }
}

/// Three figures or so, in a place of fixed width.
fn short(value: f64) -> String {
    match value.abs() {
        size if !(1e-3..1e5).contains(&size) => figures(value),
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
            [(0.0, "0"), (3.0e-5, "3e-5"), (0.1234, "0.123"), (12.34, "12.3"), (-1234.5, "-1234")]
        {
            assert_eq!(short(value), text);
        }
    }

    fn point(frame: f64, stages: &[(&'static str, f64)]) -> Point {
        Point {
            frame,
            total: 10.0,
            stages: stages.to_vec(),
            iterations: 0.0,
            residual: 0.0,
            energies: [0.0; 3],
            strain: 0.0,
        }
    }

    /// A frame in which one stage takes long does not shuffle the others.
    #[test]
    fn the_stages_that_are_shown_and_their_order_do_not_follow_single_frames() {
        let usual =
            [("f", 6.0), ("e", 5.0), ("d", 4.0), ("c", 3.0), ("b", 2.0), ("a", 0.1), ("g", 0.1)];
        let mut graphs = Graphs::default();
        for frame in 0..100 {
            graphs.points.push_back(point(f64::from(frame), &usual));
        }
        let names = graphs.largest_stages();
        assert_eq!(names, ["b", "c", "d", "e", "f"]);
        graphs.points.push_back(point(100.0, &[("g", 90.0), ("b", 80.0), ("f", 0.1)]));
        assert_eq!(graphs.largest_stages(), names);
    }
}
