//! Figures of the last frames as curves.

use std::collections::VecDeque;

use eframe::egui::Ui;
use egui_plot::{Legend, Line, Plot};

use crate::Snapshot;

/// Frames that are kept.
const LENGTH: usize = 300;
/// Stages that get a curve of their own.
const STAGES: usize = 5;

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
            plot(ui, "iterations", vec![("iterations", self.curve(|p| p.iterations))]);
            let residual = self.curve(|p| p.residual.max(1e-16).log10());
            plot(ui, "log10 of the residual", vec![("residual", residual)]);
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
        plot(ui, "largest strain [%]", vec![("strain", self.curve(|p| 100.0 * p.strain))]);
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

fn plot(ui: &mut Ui, title: &str, curves: Vec<(&str, Vec<[f64; 2]>)>) {
    ui.label(title);
    Plot::new(title)
        .height(90.0)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .legend(Legend::default())
        .show(ui, |plot| {
            for (name, points) in curves {
                plot.line(Line::new(name, points));
            }
        });
}
