//! Contact of cloth with itself: building the candidate list, using it.

use cloth_core::{Result, stepper::FramePlan, stepper::Substep};

use super::Stages;
use crate::dispatch::{LIST_PARTICLES, SCAN_BLOCK, WORKGROUP};

impl Stages {
    /// The entry of the parameters for a call of `contact_candidates` that names no substep.
    pub(super) fn candidates_slot(&mut self) -> Result<usize> {
        let planned = if self.is_batch { self.slots.for_candidates() } else { None };
        match planned {
            Some(slot) => Ok(slot),
            None => self.slot_loosen(None),
        }
    }

    /// Records what builds the list, if it is time for that. Whether it is then built the device
    /// decides.
    pub(super) fn contact_candidates(&mut self, slot: usize) -> Result<()> {
        let Some(policy) = &self.contact else { return Ok(()) };
        let (interval, cells) = (policy.interval, policy.sizes.cells);
        let opportunity = self.list_uses.is_multiple_of(interval);
        self.list_uses += 1;
        self.slots.candidates_used(slot);
        if self.is_batch && !opportunity {
            return Ok(());
        }
        let particles = (self.particle_count(), WORKGROUP);
        let passes = [
            ("contact_candidates_check", particles),
            ("contact_candidates_count", particles),
            ("contact_candidates_scan", (cells, SCAN_BLOCK)),
            ("contact_candidates_scatter", particles),
            ("contact_candidates_list", (self.particle_count(), LIST_PARTICLES)),
        ];
        // In a batch every use of the list has checked it, and the next opportunity is not far.
        let skipped = usize::from(self.is_batch);
        for (name, items) in passes.into_iter().skip(skipped) {
            self.dispatch("contact_candidates", name, items, self.present, (slot, 0))?;
        }
        Ok(())
    }

    pub(super) fn contact_forces(&mut self) -> Result<()> {
        let is_penalty =
            self.model.self_contact().is_some_and(|contact| !contact.excludes_neighbours());
        if is_penalty { self.over_particles("contact_forces", self.slots.current) } else { Ok(()) }
    }

    pub(super) fn contact_impulses(&mut self, substep: &Substep) -> Result<()> {
        if !self.model.self_contact().is_some_and(cloth_core::SelfContact::excludes_neighbours) {
            return Ok(());
        }
        let slot = self.slot(substep)?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(
            "contact_impulses",
            "contact_impulses_count",
            items,
            self.present,
            (slot, 0),
        )?;
        self.motion_advance("contact_impulses", slot)
    }

    /// Hands the constants of the list to the device, if they changed; the list is then built anew.
    pub(super) fn contact_constants_write(&mut self) -> Result<()> {
        let Some(policy) = self.contact.as_mut().filter(|policy| policy.changed) else {
            return Ok(());
        };
        policy.changed = false;
        let constants = policy.constants();
        self.write("contact", 0, bytemuck::bytes_of(&constants))?;
        let offset = std::mem::offset_of!(crate::layout::Status, contact_built) as u64;
        self.write("status", offset, bytemuck::bytes_of(&0_u32))
    }

    /// Tells the policy how everything moves: as the centre of mass did, on average over the frame.
    pub(super) fn drift_update(&mut self, plan: &FramePlan) {
        let (Some(policy), Some(figures)) = (&mut self.contact, &self.figures) else { return };
        let mass: f64 = self.model.masses().iter().sum();
        let duration: f64 = plan.substeps.iter().map(|substep| substep.length).sum();
        let falls = !self.held.contains(&true);
        let acceleration = self.model.uniform_acceleration();
        policy.drift_suggest(std::array::from_fn(|axis| {
            let gained = if falls { 0.5 * duration * acceleration[axis] } else { 0.0 };
            figures.measures.momentum[axis] / mass + gained
        }));
    }
}
