//! What a frame did, so that it can be done again.

use cloth_core::{NewtonStart, PinWrite, stepper::Substep};

use crate::linear::SolveRequest;

/// Something that changes the state or the forces.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    PinsWrite(Vec<PinWrite>),
    FieldForces,
    ProceduralForces(Substep),
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
    SpringLinearise(Substep),
    ContactLinearise(Substep),
    ImplicitAssemble(Substep, NewtonStart),
    ColliderConstraints(Substep),
    ImplicitSolve(Substep, SolveRequest),
    VelocityAdd(f64),
    PositionAdvance(f64),
    PositionFromKept(f64),
    SemiImplicitFactorise(f64),
    SemiImplicitSolve(Substep),
    TorqueCorrect(Substep),
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
