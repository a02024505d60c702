//! What a run did, in a few lines.

use std::{
    io::{self, Write, stderr, stdout},
    time::Duration,
};

use cloth::StepReport;

use crate::{
    failure::Failure,
    units::{count_text, number_text},
};

use super::solver_summary::SolverSummary;

/// Sums over the frames of a run.
pub(super) struct Summary {
    particles: usize,
    frames: u64,
    substeps: u64,
    /// Wall time of the solver, without outputs.
    solver_time: Duration,
    strain_max: f64,
    penetration_max: f64,
    contacts_max: u64,
    solver: SolverSummary,
}

impl Summary {
    pub(super) const fn new(particles: usize) -> Self {
        Self {
            particles,
            frames: 0,
            substeps: 0,
            solver_time: Duration::ZERO,
            strain_max: 0.0,
            penetration_max: 0.0,
            contacts_max: 0,
            solver: SolverSummary::new(),
        }
    }

    pub(super) fn add(&mut self, report: &StepReport) {
        self.frames += 1;
        self.substeps += u64::from(report.substeps);
        self.solver_time += report.wall_time;
        self.strain_max = self.strain_max.max(report.measures.strain_max);
        self.penetration_max = self.penetration_max.max(report.measures.penetration_max);
        self.contacts_max = self.contacts_max.max(report.contacts);
        self.solver.add(&report.solver);
    }

    /// Speed of the solver.
    pub(super) fn rate_text(&self) -> String {
        let steps = self.particles as f64 * self.substeps as f64;
        let seconds = self.solver_time.as_secs_f64();
        let rate = if seconds > 0.0 { steps / seconds } else { 0.0 };
        format!("{} particle-steps/s", number_text(rate))
    }

    pub(super) fn lines(&self, elapsed: Duration) -> Vec<String> {
        let first = format!(
            "{}, {} of {} in {:.1} s, {:.1} s of it in the solver: {}",
            count_text(self.frames, "frame"),
            count_text(self.substeps, "substep"),
            count_text(self.particles as u64, "particle"),
            elapsed.as_secs_f64(),
            self.solver_time.as_secs_f64(),
            self.rate_text(),
        );
        let second = format!(
            "largest strain {:.3}, deepest penetration {:.2e} m, at most {}",
            self.strain_max,
            self.penetration_max,
            count_text(self.contacts_max, "contact"),
        );
        let mut lines = vec![first, second];
        lines.extend(self.solver.lines(self.substeps));
        lines
    }
}

/// Prints `lines` to stdout, or to stderr if stdout is for JSON.
pub(super) fn print(lines: &[String], json: bool) -> Result<(), Failure> {
    let text = lines.join("\n") + "\n";
    let result = if json {
        stderr().write_all(text.as_bytes())
    } else {
        stdout().write_all(text.as_bytes())
    };
    match result {
        // The files are there, whoever reads along.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => Ok(result?),
    }
}
