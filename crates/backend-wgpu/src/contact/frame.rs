//! What frames did, so that they can be done again.

use std::sync::Arc;

use cloth_core::{
    NewtonStart, PinWrite,
    stepper::{FramePlan, Substep},
};

use crate::{linear::SolveRequest, readback::Answer, slots::Slots};

/// Something that changes the state or the forces.
#[derive(Clone, Debug)]
pub(crate) enum Command {
    PinsWrite(Vec<PinWrite>),
    ControlForces(Substep),
    ControlForcesRestore,
    ControlForcesAssemble(Substep, NewtonStart),
    FieldForces,
    ProceduralForces(Substep),
    SpringForces,
    MembraneForces,
    BendingForces,
    AerodynamicForces(Substep),
    ContactCandidates,
    ContactForces,
    IntegrateExplicit(Substep),
    ContactImpulses(Substep),
    StrainLimit(Substep, usize),
    StretchLimit(Substep, usize),
    ColliderResponse(Substep),
    ExplicitPass(Substep),
    StateKeep,
    StartKeep,
    IterateKeep,
    StateRestore,
    VelocityKeep,
    VelocityRestore,
    SpringLinearise(Substep),
    MembraneLinearise(Substep, NewtonStart),
    BendingLinearise(Substep, NewtonStart),
    ContactLinearise(Substep),
    ImplicitAssemble(Substep, NewtonStart),
    ColliderConstraints(Substep),
    ConstraintImpulses(NewtonStart),
    ImplicitSolve(Substep, SolveRequest),
    VelocityAdd(f64),
    PositionAdvance(f64),
    PositionFromKept(f64),
    SemiImplicitFactorise(f64),
    SemiImplicitSolve(Substep),
    TorqueCorrect(Substep),
}

impl Command {
    /// Whether it uses or builds the list of groups.
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

/// Frames, or a part of one, that are not yet known to be good.
#[derive(Debug)]
pub(crate) struct OpenFrames {
    /// The motion at their start, which nothing may overwrite.
    pub(crate) start: usize,
    /// Each of them.
    pub(crate) frames: Vec<OpenFrame>,
    /// What the device was asked while it goes on.
    pub(crate) question: Option<Question>,
}

/// Whether the first ones of the open frames are good.
#[derive(Debug)]
pub(crate) struct Question {
    /// Number of these frames.
    pub(crate) frames: usize,
    /// The motion after them, which nothing may overwrite: the others begin with it.
    pub(crate) motion: usize,
    /// The status after them.
    pub(crate) status: Answer,
}

/// A frame, or a part of one.
#[derive(Debug)]
pub(crate) struct OpenFrame {
    /// The parameters of its substeps, and the counters at its start.
    pub(crate) slots: Slots,
    /// What else varies from one substep to the next, if there was a frame.
    pub(crate) plan: Option<Arc<FramePlan>>,
    /// What was done since its start.
    pub(crate) commands: Vec<Command>,
}
