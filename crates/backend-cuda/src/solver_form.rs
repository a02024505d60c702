//! The forms of the kernels of the linear solvers.

use crate::layout::BLOCK;

/// Threads that work out a row together, as in `shared/team.cuh`.
const ROW_TEAM: usize = 4;

/// A form of the kernel. All take every model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum SolverForm {
    /// One thread for each row.
    General,
    /// The same with several threads for each row, as long as the device has them for nearly all rows at once. A block has a multiprocessor for itself.
    Teams,
    /// With the preconditioner `schwarz`.
    Schwarz,
}

impl SolverForm {
    /// The modules that have these forms.
    pub(crate) const MODULES: [&str; 2] = ["conjugate_gradient", "jacobi"];
    /// Threads of a block.
    pub(crate) const THREADS: usize = BLOCK;

    /// The form that is fastest for so many particles, on a device with so many multiprocessors. Where triangles touch, rows are far longer, and
    /// teams are faster even if each has two of them.
    pub(crate) const fn of(
        particles: usize,
        multiprocessors: usize,
        is_schwarz: bool,
        has_contacts: bool,
    ) -> Self {
        let rows = if has_contacts { 2 } else { 1 };
        if is_schwarz {
            Self::Schwarz
        } else if particles <= rows * multiprocessors * Self::Teams.step() {
            Self::Teams
        } else {
            Self::General
        }
    }

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
