//! What a run did, in a few lines.

use std::{
    io::{self, Write, stdout},
    time::Duration,
};

use cloth::{FabricAudit, StepReport};

use crate::{
    audit::IntersectionSummary,
    failure::Failure,
    say::{self, Level, Shown},
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
    compression_max: f64,
    /// Largest principal stretch of fabric, and how it lies in the last frame.
    stretch_max: f64,
    fabric: Option<FabricAudit>,
    /// Most pairs of particles closer than half the contact distance, and the first frame with any.
    close_pairs_max: u64,
    close_pairs_first: Option<u64>,
    /// Ways that contact of triangles has shortened, and the most pairs that it could not prove to be apart.
    truncated: u64,
    exempt_max: u64,
    ghosts_max: u64,
    ghosts: u64,
    bodies_at_speed_limit: u32,
    /// What the audit found, if it was asked for.
    pub(super) intersections: IntersectionSummary,
    /// What the scene is warned of before it runs.
    warnings: Vec<String>,
    pub(super) solver: SolverSummary,
}

impl Summary {
    pub(super) const fn new(particles: usize, warnings: Vec<String>) -> Self {
        Self {
            particles,
            frames: 0,
            substeps: 0,
            solver_time: Duration::ZERO,
            strain_max: 0.0,
            penetration_max: 0.0,
            contacts_max: 0,
            compression_max: 0.0,
            stretch_max: 0.0,
            fabric: None,
            close_pairs_max: 0,
            close_pairs_first: None,
            truncated: 0,
            exempt_max: 0,
            ghosts_max: 0,
            ghosts: 0,
            bodies_at_speed_limit: 0,
            intersections: IntersectionSummary::new(),
            warnings,
            solver: SolverSummary::new(),
        }
    }

    /// Adds what was done for a frame.
    pub(super) fn add(&mut self, frame: u64, report: &StepReport) {
        let audit = &report.audit;
        self.compression_max = self.compression_max.max(audit.compression_max);
        self.close_pairs_max = self.close_pairs_max.max(audit.close_pairs);
        if audit.close_pairs > 0 {
            self.close_pairs_first = self.close_pairs_first.or(Some(frame));
        }
        if let Some(fabric) = &audit.fabric {
            self.stretch_max = self.stretch_max.max(fabric.stretches[1]);
            self.fabric = Some(*fabric);
        }
        self.bodies_at_speed_limit = self.bodies_at_speed_limit.max(report.bodies_at_speed_limit);
        self.frames += 1;
        self.substeps += u64::from(report.substeps);
        self.solver_time += report.wall_time;
        self.strain_max = self.strain_max.max(report.measures.strain_max);
        self.penetration_max = self.penetration_max.max(report.measures.penetration_max);
        self.contacts_max = self.contacts_max.max(report.contacts);
        self.truncated += report.contact_truncated;
        self.exempt_max = self.exempt_max.max(report.contact_exempt);
        self.ghosts_max = self.ghosts_max.max(report.contact_ghosts);
        self.ghosts = report.contact_ghosts;
        self.solver.add(&report.solver);
    }

    /// Speed of the solver.
    pub(super) fn rate_text(&self) -> String {
        let steps = self.particles as f64 * self.substeps as f64;
        let seconds = self.solver_time.as_secs_f64();
        let rate = if seconds > 0.0 { steps / seconds } else { 0.0 };
        format!("{} particle-steps/s", number_text(rate))
    }

    /// How fabric lies at the end.
    fn fabric_text(&self, fabric: &FabricAudit) -> String {
        let percent = |strain: f64| 100.0 * strain;
        let range = |[least, largest]: [f64; 2]| {
            format!("{:.2} to {:.2} %", percent(least), percent(largest))
        };
        let [warp, weft, shear] = fabric.strains.map(range);
        format!(
            "fabric: stretched to {:.3} at most; at the end to {:.3}, E11 {warp}, E22 {weft}, E12 {shear}; {:.3e} J in stretch and shear, \
             {:.3e} J in folds",
            self.stretch_max, fabric.stretches[1], fabric.energy_membrane, fabric.energy_bending
        )
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
            "largest strain {:.3}, compression {:.3}, deepest penetration of colliders {:.2e} m, at most {}",
            self.strain_max,
            self.compression_max,
            self.penetration_max,
            count_text(self.contacts_max, "contact"),
        );
        let mut lines = vec![first, second];
        lines.extend(self.fabric.map(|fabric| self.fabric_text(&fabric)));
        lines.extend(self.solver.lines(self.substeps));
        if self.truncated > 0 {
            lines.push(format!(
                "{} shortened so that no cloth goes through cloth, and no triangle stretches beyond its limit",
                count_text(self.truncated, "way"),
            ));
        }
        if self.exempt_max > 0 {
            lines.push(format!(
                "warning: up to {} of triangles go through each other from the start: contact cannot part them, and leaves them out of \
                 its proof; let cloths start apart",
                count_text(self.exempt_max, "pair"),
            ));
        }
        if self.ghosts_max > 0 {
            lines.push(format!(
                "bodies pinched cloth: up to {} inside of them at a time, {} at the end",
                count_text(self.ghosts_max, "particle"),
                self.ghosts,
            ));
        }
        if let Some(frame) = self.close_pairs_first {
            lines.push(format!(
                "warning: from frame {frame} on up to {} of particles came closer than half the contact distance: cloth may have gone \
                 into or through cloth; use a shorter time step, or a larger contact distance",
                count_text(self.close_pairs_max, "pair"),
            ));
        }
        lines.extend(self.intersections.line());
        if self.bodies_at_speed_limit > 0 {
            lines.push(format!(
                "warning: rigid bodies reached the largest speed of their solver, 400 m/s or an eighth of a turn in a step, and would have \
                 been faster: at most {} at once",
                self.bodies_at_speed_limit,
            ));
        }
        lines.extend(self.warnings.iter().map(|warning| format!("warning: {warning}")));
        lines
    }
}

/// Prints `lines` to stdout, or to stderr if stdout is for JSON.
pub(super) fn print(lines: &[String], json: bool) -> Result<(), Failure> {
    if json || !say::is_at(Level::Normal) {
        lines.iter().for_each(say::note);
        return Ok(());
    }
    let text = lines.join("\n") + "\n";
    match Shown(stdout()).write_all(text.as_bytes()) {
        // The files are there, whoever reads along.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => Ok(result?),
    }
}
