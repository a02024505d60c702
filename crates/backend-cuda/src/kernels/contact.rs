//! Contact between cloths.

use cloth_core::{ContactStatistics, Result};

use super::CudaKernels;
use crate::{
    contact::ContactMemory,
    layout::{CudaReal, Status},
    queue::{Launch, argument},
};

impl<T: CudaReal> CudaKernels<T> {
    /// Lets the device see whether the list holds for this use, and build it if not.
    pub(super) fn list_start(&mut self, tick: u32) -> Result<()> {
        let (_, launch, chunk) = self.memory.list_launch()?;
        let frame_chunk = std::mem::replace(&mut self.memory.data.chunk, chunk);
        let name = ("contact_candidates", "contact_candidates");
        let started = self.start(name, launch, &[argument(&tick)]);
        self.memory.data.chunk = frame_chunk;
        started
    }

    /// Makes sure that the list holds for the present positions.
    pub(super) fn list_update(&mut self) -> Result<()> {
        if self.memory.contact.is_none() {
            return Ok(());
        }
        loop {
            self.tick += 1;
            self.list_start(self.tick)?;
            let status = self.memory.status_read()?;
            self.status_book(&status);
            if status.overflow == 0 {
                return Ok(());
            }
            self.list_grow(status.overflow)?;
        }
    }

    /// Makes room for `needed` candidates of each particle and forgets the list.
    pub(super) fn list_grow(&mut self, needed: u32) -> Result<()> {
        let Some(contact) = &mut self.memory.contact else { return Ok(()) };
        contact.grow(&self.memory.queue, needed)?;
        let distance = self.model.self_contact().map_or(0.0, |contact| contact.distance);
        contact.describe(&mut self.memory.data, distance, self.config.time_step);
        self.memory.status_reset()
    }

    /// Books what the device did with the list.
    pub(super) fn status_book(&mut self, status: &Status) {
        // Each pair is counted from both ends.
        self.statistics.contacts = status.contacts / 2;
        self.statistics.candidates = status.candidates / 2;
        self.statistics.rebuilds = status.rebuilds;
    }

    /// Sets the count of contacts back.
    pub(super) fn contacts_clear(&mut self) -> Result<()> {
        if self.memory.contact.is_none() {
            return Ok(());
        }
        self.start(("contact_impulses", "contacts_clear"), Launch::over(1), &[])
    }

    /// Counts the partners of every particle.
    pub(super) fn contacts_count(&mut self) -> Result<()> {
        self.contacts_clear()?;
        let launch = Launch::over(self.count());
        self.start(("contact_impulses", "contact_impulses_count"), launch, &[])
    }

    /// Impulses of all pairs in contact.
    pub(super) fn impulses(&mut self, length: f64, step: u64) -> Result<()> {
        self.contacts_count()?;
        let launch = Launch::over(self.count());
        let recovery = Self::recovery(length);
        let arguments = [argument(&recovery), argument(&step)];
        self.start(("contact_impulses", "contact_impulses"), launch, &arguments)?;
        self.memory.swap();
        Ok(())
    }

    /// Counts since the last call.
    pub(super) fn contact_counts(&mut self) -> Result<ContactStatistics> {
        if self.memory.contact.is_none() {
            return Ok(ContactStatistics::default());
        }
        let status = self.memory.status_read()?;
        self.status_book(&status);
        let uses = self.tick - std::mem::replace(&mut self.tick_counted, self.tick);
        if uses > 0 {
            let horizon = ContactMemory::<T>::horizon(uses, status.rebuilds);
            self.memory.data.list_horizon = T::from_f64(horizon);
        }
        self.start(("contact_impulses", "rebuilds_clear"), Launch::over(1), &[])?;
        Ok(self.statistics)
    }

    /// The mean motion of a state with this momentum, which the list takes away from all others.
    pub(super) fn drift_choose(&mut self, momentum: [f64; 3]) {
        let drift = momentum.map(|component| component / self.mass * self.config.time_step);
        if drift.iter().all(|component| component.is_finite()) {
            self.memory.data.drift = drift.map(T::from_f64);
        }
    }

    /// All pairs in contact, from the list and, where joined pairs count, from the springs.
    pub(super) fn pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        out.clear();
        let Some(contact) = &self.memory.contact else { return Ok(()) };
        let (mut counts, mut candidates, mut position) = (Vec::new(), Vec::new(), Vec::new());
        let queue = &self.memory.queue;
        contact.read(queue, &mut counts, &mut candidates)?;
        self.memory.position[self.memory.present()].read(queue, &mut position)?;
        let distance = self.memory.data.contact_distance;
        let limit = distance * distance;
        let touches = |i: usize, j: usize| {
            let d: [T; 3] = std::array::from_fn(|axis| position[i][axis] - position[j][axis]);
            d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < limit
        };
        let springs = self.model.springs();
        for i in 0..self.count() {
            let listed = (0..counts[i] as usize).map(|k| candidates[k * self.count() + i]);
            let joined = springs.row(i).map(|spring| springs.columns()[spring]);
            let joined = joined.filter(|_| contact.is_penalty());
            let mut partners: Vec<u32> = listed
                .chain(joined)
                .filter(|&j| j as usize > i && touches(i, j as usize))
                .collect();
            partners.sort_unstable();
            out.extend(partners.into_iter().map(|j| [i as u32, j]));
        }
        Ok(())
    }
}
