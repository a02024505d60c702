//! Contact of cloth with itself: building the list of groups, searching for pairs in contact, using them.

use cloth_core::{Result, stepper::Substep};

use super::Stages;
use crate::dispatch::WORKGROUP;

impl Stages {
    /// The entry of the parameters for a call of `contact_candidates` that names no substep.
    pub(super) fn candidates_slot(&mut self) -> Result<usize> {
        let planned = if self.is_batch { self.slots.for_candidates() } else { None };
        match planned {
            Some(slot) => Ok(slot),
            None => self.slot_loosen(None),
        }
    }

    /// Records the search for the pairs in contact, with all that it needs.
    pub(super) fn contact_candidates(&mut self, slot: usize) -> Result<()> {
        self.slots.candidates_used(slot);
        // Also where the boxes are known: this pass makes room for long rows.
        self.group_boxes(slot)?;
        self.group_list(slot)?;
        self.over_groups("contact_candidates", "contact_candidates_list", self.present, slot)
    }

    /// Records what the fused substep needs to search for pairs by itself: boxes around groups, if the pass that
    /// moved the particles did not make them, and the list of groups, if it is time for that.
    pub(super) fn groups_prepare(&mut self, slot: usize) -> Result<()> {
        let Some(policy) = &self.contact else { return Ok(()) };
        let opportunity = self.list_uses.is_multiple_of(policy.interval);
        self.list_uses += 1;
        self.slots.candidates_used(slot);
        if !self.has_boxes[self.present] {
            self.group_boxes(slot)?;
        }
        if opportunity || !self.is_batch { self.group_list(slot) } else { Ok(()) }
    }

    fn group_boxes(&mut self, slot: usize) -> Result<()> {
        self.over_groups("contact_candidates", "contact_candidates_boxes", self.present, slot)?;
        self.has_boxes[self.present] = true;
        Ok(())
    }

    /// Records what builds the list. Whether it is then built the device decides.
    fn group_list(&mut self, slot: usize) -> Result<()> {
        for name in ["contact_candidates_regions", "contact_candidates_groups"] {
            self.over_groups("contact_candidates", name, self.present, slot)?;
        }
        Ok(())
    }

    /// A kernel with one workgroup for each group of particles.
    fn over_groups(
        &mut self,
        stage: &'static str,
        name: &'static str,
        output: usize,
        slot: usize,
    ) -> Result<()> {
        let Some(policy) = &self.contact else { return Ok(()) };
        let items = (policy.sizes.groups, 1);
        self.dispatch(stage, name, items, output, (slot, 0))
    }

    /// The fused substep with contact, from the present motion to the next one.
    pub(super) fn groups_advance(&mut self, slot: usize) -> Result<()> {
        self.groups_prepare(slot)?;
        let next = self.free_motion();
        let name = "explicit_substep";
        self.over_groups("explicit_substep", name, next, slot)?;
        self.has_boxes[next] = true;
        self.present = next;
        Ok(())
    }

    pub(super) fn contact_forces(&mut self) -> Result<()> {
        if self.triangles.is_some() {
            self.triangle_forces()
        } else if self.is_penalty() {
            self.over_particles("contact_forces", self.slots.current)
        } else {
            Ok(())
        }
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
        self.list_uses = 0;
        let constants = policy.constants();
        self.write("contact", 0, bytemuck::bytes_of(&constants))?;
        let offset = std::mem::offset_of!(crate::layout::Status, contact_built) as u64;
        self.write("status", offset, bytemuck::bytes_of(&0_u32))
    }
}
