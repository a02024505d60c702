//! The forms of the kernel of the linear solvers. Which one a model gets is decided in `linear/launch.rs`.

use crate::layout::BLOCK;

/// Threads that work out a row together, as in `shared/team.cuh`.
const ROW_TEAM: usize = 4;

/// A form of the kernel. All take every model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum SolverForm {
    /// One thread for each row.
    General,
    /// The same with several threads for each row, where there are far fewer particles than the device has threads.
    Teams,
    /// With the preconditioner `schwarz`.
    Schwarz,
}

impl SolverForm {
    /// The module of the kernel.
    pub(crate) const MODULE: &str = "conjugate_gradient";
    /// Threads of a block.
    pub(crate) const THREADS: usize = BLOCK;

    /// The option that the kernel is compiled with.
    pub(crate) const fn option(self) -> Option<&'static str> {
        match self {
            Self::General => None,
            Self::Teams => Some("teams"),
            Self::Schwarz => Some("schwarz"),
        }
    }

    /// Particles that a block takes in a step.
    pub(crate) const fn step(self) -> usize {
        match self {
            Self::Teams => Self::THREADS / ROW_TEAM,
            Self::General | Self::Schwarz => Self::THREADS,
        }
    }
}
