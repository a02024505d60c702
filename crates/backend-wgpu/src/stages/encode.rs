//! From commands to recorded kernels.

use cloth_core::{Result, stepper::Substep};

use super::Stages;
use crate::{
    contact::{Command, OpenFrame, OpenFrames},
    dispatch::WORKGROUP,
};

/// Frames that may be under way before the host knows whether they are good.
pub(super) const FRAMES_AHEAD: usize = 8;

impl Stages {
    /// Runs a command. Where the device may turn out to have been given too little to do, or too little
    /// room, it becomes part of an open frame; outside a batch that is settled at once.
    pub(crate) fn execute(&mut self, command: Command) -> Result<()> {
        if !(self.contact.is_some() || (self.solve_policy.is_some() && self.is_batch)) {
            return self.encode(&command);
        }
        let alone = !self.is_batch && self.open.is_none();
        if alone && matches!(command, Command::ContactForces | Command::ContactImpulses(_)) {
            // The pairs at the present positions first, so that the command cannot fail half way.
            self.execute(Command::ContactCandidates)?;
            return self.encode(&command);
        }
        if self.open.is_none() && (self.is_batch || command.has_contact()) {
            let frames = vec![self.frame_open()];
            self.open = Some(OpenFrames { start: self.present, frames, question: None });
            self.impulses_copy(["collider_impulses", "collider_impulses_of_frame"])?;
        }
        self.encode(&command)?;
        let has_contact = command.has_contact();
        if let Some(frame) = self.open.as_mut().and_then(|open| open.frames.last_mut()) {
            frame.commands.push(command);
        }
        if has_contact && !self.is_batch { self.settle() } else { Ok(()) }
    }

    /// Whether frames may have to be done again.
    pub(super) const fn may_repeat(&self) -> bool {
        self.contact.is_some() || self.solve_policy.is_some()
    }

    /// A frame that begins now.
    pub(super) fn frame_open(&self) -> OpenFrame {
        OpenFrame { slots: self.slots.clone(), plan: self.plan.clone(), commands: Vec::new() }
    }

    /// Makes sure that a frame may follow, before anything belongs to it.
    pub(super) fn frame_admit(&mut self) -> Result<()> {
        if self.asks_ahead() {
            self.frames_confirm()?;
        }
        if self.looks_ahead(FRAMES_AHEAD) { Ok(()) } else { self.settle() }
    }

    /// Whether up to `most` frames may follow each other before the host knows that they are good.
    fn looks_ahead(&self, most: usize) -> bool {
        self.solve_policy.is_none()
            && self.failure.is_none()
            && self.open.as_ref().is_some_and(|open| open.frames.len() < most)
    }

    /// Whether the device decides how the solves of an implicit substep go on.
    pub(crate) const fn defers(&self) -> bool {
        self.is_batch && self.solve_policy.is_some()
    }

    /// Whether calls belong to a batch from now on; says what was so before.
    pub(crate) const fn batch_set(&mut self, is_batch: bool) -> bool {
        std::mem::replace(&mut self.is_batch, is_batch)
    }

    pub(crate) fn batch_begin(&mut self) {
        self.is_batch = true;
        // The frame that has begun is one of them. It may be the last one: `frame_admit` is going to make room for the next one.
        let most = FRAMES_AHEAD + usize::from(self.asks_ahead());
        let settled = if self.looks_ahead(most) { Ok(()) } else { self.settle() };
        if let Err(error) = settled.and_then(|()| self.constrained_reset()) {
            self.failure = Some(error);
        }
    }

    /// Hands the batch over. Its results are asked for later.
    pub(crate) fn batch_end(&mut self) {
        self.is_batch = false;
        if let Err(error) = self.recorder.submit(&self.context) {
            self.failure = Some(error);
        }
    }

    /// Records a command.
    pub(super) fn encode(&mut self, command: &Command) -> Result<()> {
        match command {
            Command::PinsWrite(pins) => self.pins_write(pins),
            Command::ControlForces(substep) => self.control_forces(substep),
            Command::ControlForcesRestore => self.control_forces_restore(),
            Command::ControlForcesAssemble(substep, start) => {
                self.control_forces_assemble(substep, *start)
            }
            Command::FieldForces => {
                self.has_force = true;
                self.over_particles("field_forces", 0)
            }
            Command::ProceduralForces(_) if self.procedural.is_none() => Ok(()),
            Command::ProceduralForces(substep) => {
                let slot = self.slot(substep)?;
                self.over_particles("procedural_forces", slot)
            }
            Command::SpringForces => self.over_particles("spring_forces", 0),
            Command::MembraneForces => self.membrane_forces(),
            Command::BendingForces => self.bending_forces(),
            Command::AerodynamicForces(_) if self.model.air().is_none() => Ok(()),
            Command::AerodynamicForces(substep) => {
                let slot = self.slot(substep)?;
                self.over_particles("aerodynamic_forces", slot)
            }
            Command::ContactCandidates => {
                let slot = self.candidates_slot()?;
                self.contact_candidates(slot)
            }
            Command::ContactForces => self.contact_forces(),
            Command::IntegrateExplicit(substep) => self.integrate_explicit(substep),
            Command::ContactImpulses(substep) => self.contact_impulses(substep),
            Command::StrainLimit(substep, colour) => {
                self.colour_limit("strain_limit", substep, *colour)
            }
            Command::StretchLimit(substep, colour) => {
                self.colour_limit("stretch_limit", substep, self.spring_colours + colour)
            }
            Command::ColliderResponse(substep) => self.collider_response(substep),
            Command::ExplicitPass(substep) => self.explicit_pass(substep),
            Command::StateKeep => self.state_keep(),
            Command::StartKeep => self.start_keep(),
            Command::IterateKeep => self.iterate_keep(),
            Command::StateRestore => self.state_restore(),
            Command::VelocityKeep => self.iterate_copy(true),
            Command::VelocityRestore => self.iterate_copy(false),
            Command::SpringLinearise(substep) => self.spring_linearise(substep),
            Command::MembraneLinearise(substep, start) => self.membrane_linearise(substep, *start),
            Command::BendingLinearise(substep, start) => self.bending_linearise(substep, *start),
            Command::ContactLinearise(substep) => self.contact_linearise(substep),
            Command::ImplicitAssemble(substep, start) => self.implicit_assemble(substep, *start),
            Command::ColliderConstraints(substep) => self.collider_constraints(substep),
            Command::ConstraintImpulses(start) => self.constraint_impulses(*start),
            Command::ImplicitSolve(substep, request) => self.solve_record(substep, request),
            Command::VelocityAdd(scale) => self.motion_change("velocity_add", *scale),
            Command::PositionAdvance(length) => self.motion_change("position_advance", *length),
            Command::SemiImplicitFactorise(length) => self.semi_implicit_factorise(*length),
            Command::SemiImplicitSolve(substep) => self.semi_implicit_solve(substep),
            Command::TorqueCorrect(substep) => self.torque_correct(substep),
            Command::PositionFromKept(length) => self.motion_change("position_from_kept", *length),
        }
    }

    /// A kernel with one thread for each particle, in place or without changing the motion.
    pub(super) fn over_particles(&mut self, name: &'static str, slot: usize) -> Result<()> {
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(name, name, items, self.present, (slot, 0))
    }

    /// A kernel with one thread for each particle, from the present motion to the next one.
    pub(super) fn motion_advance(&mut self, name: &'static str, slot: usize) -> Result<()> {
        let items = (self.particle_count(), WORKGROUP);
        let next = self.free_motion();
        self.dispatch(name, name, items, next, (slot, 0))?;
        self.has_boxes[next] = false;
        self.present = next;
        Ok(())
    }

    /// The entry of the parameters for a substep.
    pub(super) fn slot(&mut self, substep: &Substep) -> Result<usize> {
        match self.slots.find(substep, false) {
            Some(slot) => Ok(slot),
            None => self.slot_loosen(Some(substep)),
        }
    }

    /// The entry for a substep that counts as one more.
    fn slot_fresh(&mut self, substep: &Substep) -> Result<usize> {
        match self.slots.find(substep, true) {
            Some(slot) => Ok(slot),
            None => self.slot_loosen(Some(substep)),
        }
    }

    pub(super) fn slot_loosen(&mut self, substep: Option<&Substep>) -> Result<usize> {
        let slot = self.slots.loosen(substep);
        self.slot_write(slot)?;
        Ok(slot)
    }

    fn integrate_explicit(&mut self, substep: &Substep) -> Result<()> {
        if !self.has_force {
            return Ok(());
        }
        let slot = self.slot(substep)?;
        self.motion_advance("integrate_explicit", slot)
    }

    fn colour_limit(&mut self, name: &'static str, substep: &Substep, colour: usize) -> Result<()> {
        let Some(count) = self.colours.get(colour).map(|colour| colour.count) else {
            return Ok(());
        };
        let slot = self.slot(substep)?;
        self.in_place()?;
        self.dispatch(name, name, (count, WORKGROUP), self.present, (slot, colour))
    }

    fn collider_response(&mut self, substep: &Substep) -> Result<()> {
        let slot = self.slot(substep)?;
        if self.slots.data()[slot].collider_count == 0 {
            return Ok(());
        }
        self.in_place()?;
        if self.model.has_passable_colliders() && !std::mem::take(&mut self.has_start) {
            // Nobody knows where it started: no particle has moved.
            self.start_keep()?;
            self.has_start = false;
        }
        self.over_particles("collider_response", slot)
    }

    /// All forces, integration and, where nothing comes between, colliders.
    fn explicit_pass(&mut self, substep: &Substep) -> Result<()> {
        let slot = self.slot_fresh(substep)?;
        if self.model.has_fabric() {
            self.over_folds("explicit_substep", "bending_forces_folds", slot)?;
            self.over_elements("explicit_substep", "explicit_substep_fabric", slot)?;
            self.over_folds("explicit_substep", "bending_forces", slot)?;
        }
        if self.is_penalty() {
            return self.groups_advance(slot);
        }
        self.motion_advance("explicit_substep", slot)
    }
}
