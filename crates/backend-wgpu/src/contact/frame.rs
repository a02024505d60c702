//! What a frame did, so that it can be done again.

use cloth_core::{PinWrite, stepper::Substep};

/// Something that changes the state or the forces.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    PinsWrite(Vec<PinWrite>),
    FieldForces,
    SpringForces,
    AerodynamicForces(Substep),
    ContactCandidates,
    ContactForces,
    IntegrateExplicit(Substep),
    ContactImpulses(Substep),
    StrainLimit(Substep, usize),
    ColliderResponse(Substep),
    ExplicitPass(Substep),
    StateKeep,
    StateRestore,
}

impl Command {
    /// Whether it uses or builds the candidate list.
    pub(crate) const fn has_contact(&self) -> bool {
        matches!(
            self,
            Self::ContactCandidates
                | Self::ContactForces
                | Self::ContactImpulses(_)
                | Self::ExplicitPass(_)
        )
    }
}

/// A frame, or a part of one, that is not yet known to be good.
#[derive(Debug)]
pub(crate) struct OpenFrame {
    /// The motion at its start, which nothing may overwrite.
    pub(crate) start: usize,
    /// What was done since.
    pub(crate) commands: Vec<Command>,
}
