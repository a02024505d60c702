//! Reports of the frames as lines of JSON.

use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions},
    io::{self, Write, stdout},
    path::{Path, PathBuf},
};

use cloth::{
    FabricAudit, Measures, SeamReport, SolverReport, StepReport, TimeStepChange, TimeStepReason,
    audit::Intersections,
    io::{file_read, file_replace},
};
use serde::Serialize;

use crate::{
    audit::IntersectionLine,
    failure::{Failure, ReadError, WriteError},
};

/// One line: a [`StepReport`] and the frame it belongs to. Quantities are in SI units.
#[derive(Serialize)]
struct ReportLine<'a> {
    frame: u64,
    time: f64,
    substeps: u32,
    solver_solves: u32,
    solver_unconverged: u32,
    solver_iterations: u64,
    solver_residual: f64,
    solver_energy_error: Option<f64>,
    solver_restarted: u32,
    solver_preconditioner: Option<&'static str>,
    solver_factorisations: u32,
    newton_iterations: u32,
    newton_residual: f64,
    constraints_particles: u64,
    constraints_released: u64,
    time_step_failures: u32,
    time_step_changes: Vec<TimeStepLine>,
    contacts: u64,
    contact_candidates: u64,
    contact_rebuilds: u32,
    contact_truncated: u64,
    contact_exempt: u64,
    contact_ghosts: u64,
    strain_max: f64,
    strain_mean: f64,
    strain_particle: u32,
    compression_max: f64,
    compression_particle: u32,
    close_pairs: u64,
    #[serde(flatten)]
    intersections: Option<IntersectionLine>,
    #[serde(flatten)]
    fabric: Option<FabricColumns>,
    #[serde(flatten)]
    seams: Option<SeamColumns>,
    #[serde(skip_serializing_if = "Option::is_none")]
    edges_torn: Option<usize>,
    bodies_at_speed_limit: u32,
    penetration_max: f64,
    energy_kinetic: f64,
    energy_elastic: f64,
    energy_potential: f64,
    momentum: [f64; 3],
    momentum_drift: f64,
    stage_times: BTreeMap<&'a str, f64>,
    wall_time: f64,
}

/// What is in a report where it is asked for, or where there is such a thing.
#[derive(Clone, Copy, Default)]
pub(super) struct Asked<'a> {
    pub(super) intersections: Option<&'a Intersections>,
    pub(super) seams: Option<&'a SeamReport>,
    /// Edges of cloth that tears.
    pub(super) edges_torn: Option<usize>,
}

impl<'a> ReportLine<'a> {
    fn new(
        frame: u64,
        report: &'a StepReport,
        Asked { intersections, seams, edges_torn }: Asked<'_>,
    ) -> Self {
        let Measures {
            strain_max,
            strain_mean,
            strain_particle,
            penetration_max,
            energy_kinetic,
            energy_elastic,
            energy_potential,
            momentum,
            momentum_drift,
            ..
        } = report.measures;
        let SolverReport {
            solves,
            solves_unconverged,
            iterations,
            residual,
            energy_error,
            solves_restarted,
            preconditioner,
            newton_iterations,
            newton_residual,
            factorisations,
            constrained,
            released,
            // The preconditioner is told, which follows from it.
            auto: _,
            substeps_failed,
            time_step_changes,
        } = &report.solver;
        let times = report.stage_times.iter();
        Self {
            frame,
            time: report.time,
            substeps: report.substeps,
            solver_solves: *solves,
            solver_unconverged: *solves_unconverged,
            solver_iterations: *iterations,
            solver_residual: *residual,
            solver_energy_error: *energy_error,
            solver_restarted: *solves_restarted,
            solver_preconditioner: preconditioner.map(|preconditioner| preconditioner.name()),
            solver_factorisations: *factorisations,
            newton_iterations: *newton_iterations,
            newton_residual: *newton_residual,
            constraints_particles: *constrained,
            constraints_released: *released,
            time_step_failures: *substeps_failed,
            time_step_changes: time_step_changes.iter().map(TimeStepLine::from).collect(),
            contacts: report.contacts,
            contact_candidates: report.contact_candidates,
            contact_rebuilds: report.contact_rebuilds,
            contact_truncated: report.contact_truncated,
            contact_exempt: report.contact_exempt,
            contact_ghosts: report.contact_ghosts,
            strain_max,
            strain_mean,
            strain_particle,
            compression_max: report.audit.compression_max,
            compression_particle: report.audit.compression_particle,
            close_pairs: report.audit.close_pairs,
            intersections: intersections.map(IntersectionLine::from),
            fabric: report.audit.fabric.map(FabricColumns::from),
            seams: seams.map(SeamColumns::from),
            edges_torn,
            bodies_at_speed_limit: report.bodies_at_speed_limit,
            penetration_max,
            energy_kinetic,
            energy_elastic,
            energy_potential,
            momentum,
            momentum_drift,
            stage_times: times.map(|entry| (entry.stage, entry.time.as_secs_f64())).collect(),
            wall_time: report.wall_time.as_secs_f64(),
        }
    }
}

/// What is there only with fabric: E11, E22 and E12 with their smallest and largest value, and means of their absolute values.
#[derive(Serialize)]
struct FabricColumns {
    energy_membrane: f64,
    energy_bending: f64,
    stretch_min: f64,
    stretch_max: f64,
    stretch_triangle: u32,
    strain_warp: [f64; 2],
    strain_weft: [f64; 2],
    strain_shear: [f64; 2],
    strain_means: [f64; 3],
}

impl From<FabricAudit> for FabricColumns {
    fn from(audit: FabricAudit) -> Self {
        let [stretch_min, stretch_max] = audit.stretches;
        let [strain_warp, strain_weft, strain_shear] = audit.strains;
        Self {
            energy_membrane: audit.energy_membrane,
            energy_bending: audit.energy_bending,
            stretch_min,
            stretch_max,
            stretch_triangle: audit.stretched_triangle,
            strain_warp,
            strain_weft,
            strain_shear,
            strain_means: audit.strain_means,
        }
    }
}

/// What is there only with seams: the widest stitch, how wide it is and where.
#[derive(Serialize)]
struct SeamColumns {
    seams_welded: bool,
    stitches_welded: usize,
    seam_widest: f64,
    seam_place: [f64; 3],
    stitches_broken: usize,
}

impl From<&SeamReport> for SeamColumns {
    fn from(report: &SeamReport) -> Self {
        let &SeamReport { is_welded, welded, seam: _, gap, place, broken } = report;
        Self {
            seams_welded: is_welded,
            stitches_welded: welded,
            seam_widest: gap,
            seam_place: place,
            stitches_broken: broken,
        }
    }
}

/// A decision of the adaptive time step: `value` is the residual or the strain that was too large, if
/// the reason has one and it is finite.
#[derive(Serialize)]
struct TimeStepLine {
    time: f64,
    from: f64,
    to: f64,
    reason: &'static str,
    value: Option<f64>,
}

impl From<&TimeStepChange> for TimeStepLine {
    fn from(change: &TimeStepChange) -> Self {
        let TimeStepChange { time, from, to, reason } = *change;
        let (reason, value) = match reason {
            TimeStepReason::LinearSolver { residual } => ("linear solver", Some(residual)),
            TimeStepReason::NonFinite => ("not finite", None),
            TimeStepReason::Pinched => ("pinched", None),
            TimeStepReason::Strain { strain } => ("strain", Some(strain)),
            TimeStepReason::Recovered => ("recovered", None),
            _ => ("other", None),
        };
        Self { time, from, to, reason, value: value.filter(|value| value.is_finite()) }
    }
}

/// Appends to `report.jsonl`, and to stdout if asked to.
pub(super) struct ReportWriter {
    path: PathBuf,
    file: File,
    stdout: bool,
}

impl ReportWriter {
    /// Opens `path` and keeps the lines of the first `frames` frames.
    pub(super) fn open(path: &Path, frames: u64, stdout: bool) -> Result<Self, Failure> {
        lines_keep(path, frames)?;
        let file = OpenOptions::new()
            .append(true)
            .create(true)
            .open(path)
            .map_err(WriteError::of(path))?;
        Ok(Self { path: path.to_owned(), file, stdout })
    }

    pub(super) fn write(
        &mut self,
        frame: u64,
        report: &StepReport,
        asked: Asked<'_>,
    ) -> Result<(), Failure> {
        let line = ReportLine::new(frame, report, asked);
        let mut line = serde_json::to_string(&line).map_err(Failure::other)?;
        line.push('\n');
        self.file.write_all(line.as_bytes()).map_err(WriteError::of(&self.path))?;
        if self.stdout {
            match stdout().write_all(line.as_bytes()).and_then(|()| stdout().flush()) {
                // The run goes on for its files if nobody reads along any more.
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => self.stdout = false,
                result => result?,
            }
        }
        Ok(())
    }
}

/// Cuts the file after its first `count` lines; a missing file has none.
fn lines_keep(path: &Path, count: u64) -> Result<(), Failure> {
    let text = match file_read(path, u64::MAX) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        result => result.map_err(ReadError::of(path))?,
    };
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let kept: Vec<&[u8]> = text.split_inclusive(|&byte| byte == b'\n').take(count).collect();
    let result = file_replace(path, |file| kept.iter().try_for_each(|line| file.write_all(line)));
    Ok(result.map_err(WriteError::of(path))?)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn lines_of_later_frames_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.jsonl");
        fs::write(&path, "1\n2\n3\n4\n").unwrap();
        let mut writer = ReportWriter::open(&path, 2, false).unwrap();
        writer.write(3, &StepReport::default(), Asked::default()).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[..2], ["1", "2"]);
        let line: serde_json::Value = serde_json::from_str(lines[2]).unwrap();
        assert_eq!(line["frame"], 3);
        assert_eq!(lines.len(), 3);
    }

    #[test]
    fn decisions_on_the_time_step_are_in_the_line() {
        let strain = TimeStepReason::Strain { strain: 0.75 };
        let breakdown = TimeStepReason::LinearSolver { residual: f64::INFINITY };
        let change = |reason| TimeStepChange { time: 1.0, from: 0.5, to: 0.25, reason };
        let solver = SolverReport {
            solves: 3,
            solves_unconverged: 1,
            time_step_changes: vec![change(strain), change(breakdown)],
            ..SolverReport::default()
        };
        let report = StepReport { solver, ..StepReport::default() };
        let line = serde_json::to_value(ReportLine::new(1, &report, Asked::default())).unwrap();
        assert!(line.get("intersections_within").is_none(), "not asked for");
        assert_eq!((&line["solver_solves"], &line["solver_unconverged"]), (&3.into(), &1.into()));
        let changes = &line["time_step_changes"];
        let first = serde_json::json!(
            { "time": 1.0, "from": 0.5, "to": 0.25, "reason": "strain", "value": 0.75 }
        );
        assert_eq!(changes[0], first);
        assert_eq!(changes[1]["reason"], "linear solver");
        assert!(changes[1]["value"].is_null());
    }
}
