//! Workloads that the engine is measured by, and the programs it is measured beside.

mod hang;
mod reference;
mod workload;

pub use hang::{HANG_STEP, HangWorkload};
pub use reference::{ReferenceRow, reference_build, reference_run};
pub use workload::{FRAMES_BEFORE, FRAMES_MEASURED, RunningWorkload, Workload};
