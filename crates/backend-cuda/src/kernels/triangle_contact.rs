//! Contact of triangles: the stages, and [`DeviceContact`], which decides.

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, Model, NewtonStart, Result, State,
    contact::{
        Candidate, ContactLaw, ContactSet, Contacts, Ghost,
        device::{DeviceContact, pairs_of},
    },
    schwarz::ContactRows,
    stepper::{FramePlan, Substep},
};

use super::{CudaKernels, pair_device::Working};
use crate::{
    layout::CudaReal,
    queue::{Launch, argument},
    triangle_contact::TriangleMemory,
};

/// Contact of triangles, and its memory.
pub(super) struct Triangles<T> {
    contact: DeviceContact<T>,
    memory: TriangleMemory<T>,
}

impl<T: CudaReal> Triangles<T> {
    /// The contacts.
    pub(super) const fn set(&self) -> &ContactSet<T> {
        &self.contact.set
    }

    /// What they add to the matrix.
    pub(super) fn rows(&self) -> ContactRows<T> {
        self.contact.rows()
    }

    /// A state has been given from outside.
    pub(super) fn state_given(&mut self, model: &Model, state: &State) {
        self.contact.state_given(model, state);
    }

    pub(super) fn frame_begin(&mut self, plan: &FramePlan) {
        self.contact.frame_begin(plan);
    }

    pub(super) fn keep(&mut self) {
        self.contact.keep();
    }

    pub(super) fn restore(&mut self) {
        self.contact.restore();
    }

    pub(super) fn impulses_take(&mut self, out: &mut [ColliderImpulse]) {
        self.contact.impulses_take(out);
    }

    pub(super) fn touches(&self) -> bool {
        self.contact.touches()
    }

    pub(super) fn statistics(&mut self) -> cloth_core::ContactStatistics {
        self.contact.statistics_take()
    }
}

impl<T: CudaReal> CudaKernels<T> {
    /// Takes the memory for contact of triangles, if there is any.
    pub(super) fn triangles_prepare(&mut self) -> Result<()> {
        let pinch = self.config.pinch;
        let Some(contact) = DeviceContact::new(&self.model, pinch) else { return Ok(()) };
        let memory = TriangleMemory::new(&self.memory.queue, &contact)?;
        self.triangles = Some(Box::new(Triangles { contact, memory }));
        Ok(())
    }

    /// Does something with contact of triangles, if there is any.
    fn with_triangles<R>(
        &mut self,
        work: impl FnOnce(&mut DeviceContact<T>, &mut Working<'_, T>) -> Result<R>,
    ) -> Result<Option<R>> {
        let Some(mut triangles) = self.triangles.take() else { return Ok(None) };
        let Triangles { contact, memory } = &mut *triangles;
        let outcome = work(contact, &mut Working { kernels: self, memory });
        self.triangles = Some(triangles);
        outcome.map(Some)
    }

    /// `contact_pairs`.
    pub(super) fn triangle_pairs(&mut self, substep: &Substep) -> Result<()> {
        self.settle()?;
        let model = Arc::clone(&self.model);
        self.with_triangles(|contact, device| contact.pairs(&model, device, substep)).map(drop)
    }

    /// `contact_geometry`.
    pub(super) fn triangle_geometry(
        &mut self,
        substep: &Substep,
        newton: NewtonStart,
    ) -> Result<()> {
        self.start_ensure()?;
        let law = ContactLaw::of(&self.model, &self.config, substep.length);
        self.with_triangles(|contact, device| contact.geometry(device, law, newton)).map(drop)
    }

    /// `contact_forces` of triangles, if these touch.
    pub(super) fn triangle_forces(&mut self) -> Result<()> {
        let Some(triangles) = self.triangles.as_ref().filter(|all| all.contact.has_contacts) else {
            return Ok(());
        };
        let table = triangles.memory.table();
        let launch = Launch::over(self.count());
        let name = ("contact_forces", "contact_forces_triangles");
        self.stage("contact_forces", |kernels| kernels.start(name, launch, &[argument(&table)]))
    }

    /// `contact_linearise` of triangles: the system reads their rows.
    pub(super) fn triangle_linearise(&mut self) -> Result<()> {
        let Some(triangles) = &self.triangles else { return Ok(()) };
        let (table, has_contacts) = (triangles.memory.table(), triangles.contact.has_contacts);
        let linear = self.linear()?;
        linear.data.contacts = table;
        linear.data.has_contacts = u32::from(has_contacts);
        if !has_contacts || table.terms == 0 {
            return Ok(());
        }
        let launch = Launch::over(table.place_count as usize);
        let name = ("contact_linearise", "contact_linearise_ranks");
        self.stage("contact_linearise", |kernels| kernels.start(name, launch, &[argument(&table)]))
    }

    /// `contact_certify`.
    pub(super) fn triangle_certify(&mut self, substep: &Substep) -> Result<()> {
        self.start_ensure()?;
        let held = self.semi_implicit.held().to_vec();
        let model = Arc::clone(&self.model);
        self.with_triangles(|contact, device| contact.certify(&model, device, substep, &held))
            .map(drop)
    }

    /// `contact_certify` of an iterate.
    pub(super) fn triangle_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.start_ensure()?;
        let held = self.semi_implicit.held().to_vec();
        let model = Arc::clone(&self.model);
        let changed = self.with_triangles(|contact, device| {
            contact.certify_iterate(&model, device, substep, &held)
        })?;
        Ok(changed.unwrap_or_default())
    }

    /// `start_keep` of triangles: certificates begin there.
    pub(super) fn triangle_start_keep(&mut self) {
        if let Some(triangles) = &mut self.triangles {
            triangles.contact.start_keep();
        }
    }

    /// `iterate_keep`.
    pub(super) fn triangle_iterate_keep(&mut self) -> Result<()> {
        let Some(triangles) = &mut self.triangles else { return Ok(()) };
        triangles.contact.iterate_keep();
        self.settle()?;
        let present = self.memory.present();
        self.memory.state.proven_keep(&self.memory.queue, present)
    }

    /// All contacts as last computed.
    pub(super) fn triangle_contacts(&self, out: &mut Contacts) {
        out.contacts.clear();
        if let Some(triangles) = &self.triangles {
            triangles.contact.set.read(out);
        }
    }

    /// `stitches_set`.
    pub(super) fn triangle_stitches_set(&mut self, model: &Model) -> bool {
        let triangles = self.triangles.as_mut();
        triangles.is_none_or(|triangles| triangles.contact.stitches_set(model))
    }

    /// What bodies have pinched; `out` is resized.
    pub(super) fn triangle_ghosts(&self, out: &mut Vec<Ghost>) {
        out.clear();
        if let Some(triangles) = &self.triangles {
            out.extend_from_slice(triangles.contact.ghosts());
        }
    }

    /// `ghosts_write`.
    pub(super) fn triangle_ghosts_set(&mut self, ghosts: &[Ghost]) {
        if let Some(triangles) = &mut self.triangles {
            triangles.contact.ghosts_set(ghosts);
        }
    }

    /// The pairs of the list, ascending.
    pub(super) fn triangle_list(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        out.clear();
        self.with_triangles(|contact, device| {
            let (mut words, count) = (Vec::new(), contact.list.task.pair_count as usize);
            device.memory.list.read_first(&device.kernels.memory.queue, count, &mut words)?;
            out.extend(pairs_of(words.as_flattened()).map(|pair| pair.candidate));
            Ok(())
        })?;
        out.sort_unstable();
        Ok(())
    }

    /// Makes sure that it is known where the substep has started.
    fn start_ensure(&mut self) -> Result<()> {
        self.settle()?;
        if self.memory.state.start.is_none() { self.start_copy() } else { Ok(()) }
    }
}
