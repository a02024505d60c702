//! What came of a case, as it is written and read.

use cloth_benches::quartiles;
use serde::{Deserialize, Serialize};

/// The version of the format of [`Results`].
pub(crate) const FORMAT: u32 = 1;

/// All that a run of the program found out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Results {
    /// [`FORMAT`] of the program that wrote it.
    pub(crate) format: u32,
    /// Day, as year-month-day.
    pub(crate) date: String,
    /// Revision of the sources, or `unknown`.
    pub(crate) revision: String,
    /// Name of the suite.
    pub(crate) suite: String,
    pub(crate) machine: Machine,
    pub(crate) engines: Vec<EngineFacts>,
    /// Backends that were asked for and are not here, and why.
    pub(crate) absent: Vec<(String, String)>,
    pub(crate) records: Vec<Record>,
    /// For each backend and integrator, the largest power of ten that stiffness can be raised by.
    #[serde(default)]
    pub(crate) stiffness: Vec<(String, Vec<(String, i32)>)>,
    /// Solves of linear systems by themselves.
    #[serde(default)]
    pub(crate) linear: Vec<LinearRecord>,
    /// Cases that ended in an error.
    pub(crate) failures: Vec<Failure>,
}

/// The computer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Machine {
    pub(crate) processor: String,
    pub(crate) threads: usize,
    pub(crate) memory_gigabytes: f64,
    pub(crate) system: String,
}

/// A backend that was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct EngineFacts {
    pub(crate) backend: String,
    pub(crate) device: String,
    pub(crate) details: Vec<(String, String)>,
    /// What copies within its memory reach \[GB/s\], read and written counted.
    pub(crate) copy_rate: f64,
}

/// A case that was measured.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Record {
    /// Which table or plot it belongs to.
    pub(crate) group: String,
    pub(crate) backend: String,
    /// What distinguishes it from others of its group, such as a method.
    pub(crate) label: String,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    pub(crate) precision: String,
    pub(crate) threads: Option<usize>,
    /// Cap on the iterations of a linear solve, where all of them are done.
    pub(crate) iterations: Option<u32>,
    /// Substeps of a frame.
    pub(crate) substeps: u32,
    /// Frames before those that were timed, and timed.
    pub(crate) frames: [usize; 2],
    /// From nothing to the first frame \[ms\].
    pub(crate) first_frame: f64,
    /// A frame with its report, as an application waits for it \[ms\].
    pub(crate) frame: Statistics,
    /// A frame by the clock of the device, without stages that are there for the report alone \[ms\].
    pub(crate) device: Option<Statistics>,
    /// A frame in a row of them with one wait at their end \[ms\].
    pub(crate) in_a_row: Option<f64>,
    /// Bytes that a frame cannot do without.
    pub(crate) bytes: Option<f64>,
    /// Memory of the host for each particle \[bytes\].
    pub(crate) memory_host: f64,
    /// Memory of the device for each particle \[bytes\].
    pub(crate) memory_device: Option<f64>,
    /// Time of each stage in a frame \[ms\].
    pub(crate) stages: Vec<(String, f64)>,
    pub(crate) quality: Quality,
    pub(crate) verdict: Verdict,
    /// What the table of the group was published with for this row, in its unit.
    pub(crate) published: Option<f64>,
}

/// A solve of a linear system.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct LinearRecord {
    /// What is varied.
    pub(crate) sweep: String,
    /// Its value.
    pub(crate) x: f64,
    pub(crate) particles: u64,
    pub(crate) backend: String,
    pub(crate) preconditioner: String,
    /// What was asked for.
    pub(crate) goal: String,
    pub(crate) iterations: u32,
    /// Whether that was reached.
    pub(crate) is_reached: bool,
    /// Time to build the preconditioner \[ms\].
    pub(crate) build: f64,
    /// Time of a solve \[ms\].
    pub(crate) solve: f64,
}

impl Record {
    pub(crate) fn particles(&self) -> u64 {
        u64::from(self.columns) * u64::from(self.rows)
    }

    /// The time of a frame \[ms\] by the best clock there is: that of the device, a row of frames, single
    /// frames.
    pub(crate) fn time(&self) -> f64 {
        self.device.map_or(self.in_a_row.unwrap_or(self.frame.median), |device| device.median)
    }

    /// Bytes in a second \[GB/s\], by what a frame cannot do without.
    pub(crate) fn rate(&self) -> Option<f64> {
        self.bytes.map(|bytes| bytes / self.time() / 1e6)
    }

    /// What makes it the same case in another run.
    pub(crate) fn key(&self) -> String {
        let Self { group, backend, label, columns, rows, precision, threads, iterations, .. } =
            self;
        format!("{group} {backend} {label} {columns}x{rows} {precision} {threads:?} {iterations:?}")
    }
}

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Statistics {
    pub(crate) median: f64,
    pub(crate) lower: f64,
    pub(crate) upper: f64,
}

impl Statistics {
    /// Of some samples; zeros if there is none.
    pub(crate) fn new(mut samples: Vec<f64>) -> Self {
        let [lower, median, upper] = quartiles(&mut samples);
        Self { median, lower, upper }
    }
}

/// What the time bought.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Quality {
    pub(crate) strain_mean: f64,
    pub(crate) strain_max: f64,
    /// Largest relative residual of a linear system.
    pub(crate) residual: f64,
    pub(crate) contacts: u64,
    /// Distance from the result of the reference after one more frame, root of the mean square, in units of
    /// the distance of neighbours.
    pub(crate) difference: f64,
}

/// Whether the result may be trusted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Verdict {
    /// It is that of the reference.
    Valid,
    /// It is not; the time means nothing.
    Invalid,
    /// It was not compared, for this reason.
    Unchecked(String),
}

/// A case that ended in an error.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Failure {
    pub(crate) group: String,
    pub(crate) backend: String,
    pub(crate) case: String,
    pub(crate) error: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_samples_give_zeros() {
        assert_eq!(Statistics::new(vec![]).median, 0.0);
    }
}
