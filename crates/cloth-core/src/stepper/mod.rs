//! The time integrators, each written once over the stages of [`Kernels`](crate::Kernels).

pub mod explicit;
mod finish;
mod forces;
pub mod implicit;
pub mod linear;
mod plan;
pub mod semi_implicit;
mod solver;

pub use plan::{ColliderState, FramePlan, Substep, substep_lengths};
pub use solver::SteppedSolver;
