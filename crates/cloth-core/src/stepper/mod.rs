//! The time integrators, each written once over the stages of [`Kernels`](crate::Kernels).

pub mod explicit;
mod plan;
mod solver;

pub use plan::{ColliderState, FramePlan, Substep, substep_lengths};
pub use solver::SteppedSolver;
