//! Reports of the frames as lines of JSON.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, Write, stdout},
    path::{Path, PathBuf},
};

use cloth::{Measures, StepReport, io::file_replace};
use serde::Serialize;

use crate::failure::{Failure, ReadError, WriteError};

/// One line: a [`StepReport`] and the frame it belongs to. Quantities are in SI units.
#[derive(Serialize)]
struct ReportLine<'a> {
    frame: u64,
    time: f64,
    substeps: u32,
    solver_iterations: u64,
    solver_residual: f64,
    contacts: u64,
    contact_candidates: u64,
    contact_rebuilds: u32,
    strain_max: f64,
    strain_mean: f64,
    strain_particle: u32,
    penetration_max: f64,
    energy_kinetic: f64,
    energy_elastic: f64,
    energy_potential: f64,
    momentum: [f64; 3],
    momentum_drift: f64,
    stage_times: BTreeMap<&'a str, f64>,
    wall_time: f64,
}

impl<'a> ReportLine<'a> {
    fn new(frame: u64, report: &'a StepReport) -> Self {
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
        let times = report.stage_times.iter();
        Self {
            frame,
            time: report.time,
            substeps: report.substeps,
            solver_iterations: report.solver.iterations,
            solver_residual: report.solver.residual,
            contacts: report.contacts,
            contact_candidates: report.contact_candidates,
            contact_rebuilds: report.contact_rebuilds,
            strain_max,
            strain_mean,
            strain_particle,
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

    pub(super) fn write(&mut self, frame: u64, report: &StepReport) -> Result<(), Failure> {
        let line = ReportLine::new(frame, report);
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
    let text = match fs::read(path) {
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
    use super::*;

    #[test]
    fn lines_of_later_frames_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.jsonl");
        fs::write(&path, "1\n2\n3\n4\n").unwrap();
        let mut writer = ReportWriter::open(&path, 2, false).unwrap();
        writer.write(3, &StepReport::default()).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[..2], ["1", "2"]);
        let line: serde_json::Value = serde_json::from_str(lines[2]).unwrap();
        assert_eq!(line["frame"], 3);
        assert_eq!(lines.len(), 3);
    }
}
