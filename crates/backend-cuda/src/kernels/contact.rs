//! Contact between cloths.

use cloth_core::{ContactStatistics, Result};

use super::CudaKernels;
use crate::{
    forms::FrameForm,
    layout::{CudaReal, Status},
    queue::{Launch, THREADS, argument},
};

/// What the counts of contacts on the device are of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Counts {
    /// Set back for a frame, and booked before.
    Clear,
    /// What a frame in one launch has counted since they were set back for it.
    OfFrame,
    /// What kernels outside of such a frame have counted, of the pairs of the list.
    OfList,
}

impl<T: CudaReal> CudaKernels<T> {
    /// Lets the device find the pairs in contact, and build the list of groups before if it does not hold.
    pub(super) fn contacts_start(&mut self, tick: u32) -> Result<()> {
        self.counts = Counts::OfList;
        let launch = self.contacts_launch()?;
        self.start(("contact_candidates", "contact_candidates"), launch, &[argument(&tick)])
    }

    /// The launch of the kernel that finds contacts alone: as many warps as there are groups, if they fit.
    fn contacts_launch(&mut self) -> Result<Launch> {
        let kernel = self.cache.kernel("contact_candidates", "contact_candidates")?;
        let resident = self.memory.queue.device.resident_blocks(kernel, THREADS, 0)?;
        let blocks = resident.min(self.memory.data.group_count.div_ceil(THREADS / 32));
        Ok(Launch { blocks, threads: THREADS, shared: 0, cooperative: true })
    }

    /// Finds the pairs in contact at the present positions.
    pub(super) fn contacts_find(&mut self) -> Result<()> {
        if self.memory.contact.is_none() {
            return Ok(());
        }
        loop {
            self.tick += 1;
            self.contacts_start(self.tick)?;
            let status = self.memory.status.read(&self.memory.queue)?;
            self.status_book(&status);
            if !status.overflowed() {
                return Ok(());
            }
            self.contacts_grow(&status)?;
        }
    }

    /// Makes room for what did not fit and forgets the list.
    pub(super) fn contacts_grow(&mut self, status: &Status) -> Result<()> {
        let Some(contact) = &mut self.memory.contact else { return Ok(()) };
        contact.grow(&self.memory.queue, status)?;
        let distance = self.model.self_contact().map_or(0.0, |contact| contact.distance);
        contact.describe(&mut self.memory.data, distance, self.config.time_step);
        self.memory.status.reset(&self.memory.queue)
    }

    /// Books what the device did with the list.
    pub(super) fn status_book(&mut self, status: &Status) {
        self.statistics.rebuilds = status.rebuilds;
        if self.counts != Counts::Clear {
            // Each pair is counted from both ends, those that the list makes the device look at too.
            self.statistics.contacts = status.contacts / 2;
            self.statistics.candidates = status.candidates / 2;
        }
    }

    /// Sets the count of contacts back, if wanted that of builds, too.
    fn counts_clear(&mut self, rebuilds: bool) -> Result<()> {
        let rebuilds = u32::from(rebuilds);
        self.start(("contact_impulses", "counts_clear"), Launch::over(1), &[argument(&rebuilds)])
    }

    /// Sets the counts back for a frame that comes next, where they are not yet.
    pub(super) fn frame_counts_begin(&mut self) -> Result<()> {
        // Blocks meet where stages follow the pass, and where there is contact.
        if self.memory.contact.is_none() && self.frame.form != FrameForm::Stages {
            return Ok(());
        }
        if self.counts != Counts::Clear {
            self.counts_clear(false)?;
        }
        self.counts = Counts::OfFrame;
        Ok(())
    }

    /// Counts the partners of every particle.
    pub(super) fn contacts_count(&mut self) -> Result<()> {
        self.counts_clear(false)?;
        self.counts = Counts::OfList;
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
        let status = self.memory.status.read(&self.memory.queue)?;
        self.status_book(&status);
        if self.counts == Counts::OfFrame {
            // Now, so that the frame that comes next need not wait for it.
            self.counts_clear(true)?;
            self.counts = Counts::Clear;
        } else {
            self.counts_clear(true)?;
        }
        Ok(self.statistics)
    }

    /// All pairs in contact, from the list and, where joined pairs count, from the springs.
    pub(super) fn pairs_read(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        out.clear();
        let Some(contact) = &self.memory.contact else { return Ok(()) };
        let (mut counts, mut candidates, mut position) = (Vec::new(), Vec::new(), Vec::new());
        let queue = &self.memory.queue;
        contact.read(queue, &mut counts, &mut candidates)?;
        self.memory.state.position[self.memory.present()].read(queue, &mut position)?;
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
