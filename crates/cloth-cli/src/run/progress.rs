//! How far a run is, on stderr.

use std::{
    io::{IsTerminal, stderr},
    time::{Duration, Instant},
};

use cloth::StepReport;

use indicatif::{ProgressBar, ProgressStyle};

use super::Summary;
use crate::{
    say::{self, Level},
    units::count_text,
};

/// Time between two lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// A bar on a terminal, else a line every few seconds; a line for each frame if that is asked for.
pub(super) enum Progress {
    None,
    Frames,
    Bar(ProgressBar),
    Lines { frames: u64, first: u64, start: Instant, last: Instant },
}

impl Progress {
    /// Starts at frame `first` of `frames`.
    pub(super) fn new(first: u64, frames: u64) -> Self {
        if say::is_at(Level::Verbose) {
            return Self::Frames;
        }
        if !say::is_at(Level::Normal) {
            return Self::None;
        }
        if !stderr().is_terminal() {
            let now = Instant::now();
            return Self::Lines { frames, first, start: now, last: now };
        }
        let bar = ProgressBar::new(frames);
        let style = "{wide_bar} frame {pos}/{len}, {eta} left, {msg}";
        bar.set_style(ProgressStyle::with_template(style).unwrap_or(ProgressStyle::default_bar()));
        bar.set_position(first);
        // Frames from before do not count for the time that is left.
        bar.reset_eta();
        Self::Bar(bar)
    }

    pub(super) fn frame(&mut self, frame: u64, summary: &Summary, report: &StepReport) {
        match self {
            Self::None => {}
            Self::Frames => {
                say::detail(format_args!(
                    "frame {frame}: {}, strain {:.3}, {}, {:.2} ms",
                    count_text(u64::from(report.substeps), "substep"),
                    report.measures.strain_max,
                    count_text(report.contacts, "contact"),
                    1e3 * report.wall_time.as_secs_f64(),
                ));
            }
            Self::Bar(bar) => {
                bar.set_message(summary.rate_text());
                bar.set_position(frame);
            }
            Self::Lines { frames, first, start, last } => {
                if last.elapsed() < LINE_INTERVAL {
                    return;
                }
                *last = Instant::now();
                let per_frame = start.elapsed().as_secs_f64() / (frame - *first).max(1) as f64;
                let left = per_frame * frames.saturating_sub(frame) as f64;
                let rate = summary.rate_text();
                say::note(format_args!("frame {frame}/{frames}, {left:.0} s left, {rate}"));
            }
        }
    }

    pub(super) fn finish(self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}
