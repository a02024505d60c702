//! Workloads that the engine is measured by, and the programs it is measured beside.

mod bytes;
mod chosen;
mod copy_rate;
mod field;
mod hang;
pub mod ladder;
mod reference;
mod sheet;
mod statistics;
mod workload;

pub use bytes::{ITERATION_BYTES, STATE_BYTES};
pub use chosen::{ChosenBackend, chosen_backends};
pub use copy_rate::{copy_rate_cpu, copy_rate_cuda, copy_rate_wgpu};
pub use field::{FieldCost, field_cost};
pub use hang::{HANG_STEP, HangWorkload};
pub use reference::{
    ReferenceRow, reference_build, reference_chosen, reference_run, reference_source,
    reference_state,
};
pub use sheet::SheetWorkload;
pub use statistics::{median, quartiles};
pub use workload::{FRAMES_BEFORE, FRAMES_MEASURED, RunningWorkload, Workload};
