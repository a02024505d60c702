//! The time integrators, each written once over the stages of [`Kernels`](crate::Kernels).

pub mod explicit;
mod finish;
mod forces;
mod held_places;
pub mod implicit;
mod integrate;
pub mod linear;
pub mod midpoint;
mod plan;
pub mod semi_implicit;
mod solver;
mod time_step;

pub use finish::{collider_start, colliders_and_certificate, strain_limit_sweeps};
pub use forces::contact_find;
pub use plan::{ColliderState, FramePlan, FrameSpan, Substep, substep_lengths};
pub use solver::SteppedSolver;
