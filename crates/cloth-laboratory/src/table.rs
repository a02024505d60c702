//! Outcomes as text.

use std::fmt::Write;

use crate::{Experiment, Measurement, Outcome, outcome::number};

/// A table of what was measured beside what is expected, a line for each case and mesh, coarse to fine.
#[must_use]
pub fn table(experiment: &Experiment, outcome: &Outcome) -> String {
    let mut text = format!("{}: {}\n", experiment.name, experiment.title);
    let trends = outcome.trends();
    let width = trends.iter().map(|trend| trend[0].case.chars().count()).max().unwrap_or(0);
    for trend in trends {
        let Measurement { case, mesh, expected, unit, .. } = trend[0];
        let gap = if unit.is_empty() { "" } else { " " };
        let expected = format!("{expected}{gap}{unit}");
        // Strings are never full.
        let _ = write!(text, "  {case:width$}  {:<11}  expected {expected:<24}", mesh.name());
        for row in trend {
            let mark = if row.passes() { "" } else { " FAILED" };
            let measured = number(row.measured);
            let _ = write!(text, "  {:>3} cells {measured} ({}){mark}", row.cells, row.deviation());
        }
        text.push('\n');
    }
    text
}

impl Measurement {
    /// The error in words.
    pub(crate) fn deviation(&self) -> String {
        let error = self.error();
        if !error.is_finite() {
            "-".to_owned()
        } else if matches!(self.expected, crate::Expected::Between { .. }) && self.passes() {
            "within".to_owned()
        } else {
            format!("{:+.2} %", 100.0 * error)
        }
    }
}
