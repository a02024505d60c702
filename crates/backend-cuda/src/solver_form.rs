//! The forms of the kernel of the linear solvers. Which one a model gets is decided in `linear/launch.rs`.

use crate::layout::BLOCK;

/// Threads that work out a row together, as in `shared/team.cuh`.
const ROW_TEAM: usize = 4;

/// A form of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SolverForm {
    /// For every model.
    General,
    /// The same with several threads for each row, where there are far fewer particles than the device has threads.
    Teams,
    /// For large patches of 24 neighbours, tile by tile.
    Patch,
    /// Every particle in the registers of a thread of its own for the whole solve.
    Resident,
    /// For every model, with the preconditioner `schwarz`.
    Schwarz,
}

/// What a solve asks for, of which not every form has everything.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct SolveNeeds {
    /// Pairs or triangles in contact.
    pub(crate) contact: bool,
    /// The preconditioner `schwarz`.
    pub(crate) schwarz: bool,
    /// An estimate of the error in the norm of the energy.
    pub(crate) energy: bool,
}

impl SolverForm {
    /// The module of the kernel.
    pub(crate) const fn module(self) -> &'static str {
        match self {
            Self::General | Self::Teams | Self::Resident | Self::Schwarz => "conjugate_gradient",
            Self::Patch => "conjugate_gradient_patch",
        }
    }

    /// The option that the kernel is compiled with.
    pub(crate) const fn option(self) -> Option<&'static str> {
        match self {
            Self::General | Self::Patch => None,
            Self::Teams => Some("teams"),
            Self::Resident => Some("resident"),
            Self::Schwarz => Some("schwarz"),
        }
    }

    /// Threads of a block.
    pub(crate) const fn threads(self) -> usize {
        match self {
            Self::General | Self::Teams | Self::Schwarz => BLOCK,
            Self::Patch | Self::Resident => BLOCK / 2,
        }
    }

    /// Particles that a block takes in a step.
    pub(crate) const fn step(self) -> usize {
        match self {
            Self::Teams => self.threads() / ROW_TEAM,
            _ => self.threads(),
        }
    }
}
