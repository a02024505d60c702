//! The array of per-substep parameters: one entry for each substep of a frame, one for the state
//! after the frame, one for calls that are in no frame.

use cloth_core::{
    SelfContact,
    stepper::{self, FramePlan},
};

use crate::layout::{FLAG_COUNT_CONTACTS, Substep};

/// Parameters of all substeps, and the counters that tell them apart.
#[derive(Clone, Debug)]
pub(crate) struct Slots {
    /// The substeps of the frame, then the closing one, then the loose one.
    data: Vec<Substep>,
    /// The substeps that the entries are for.
    plan: Vec<stepper::Substep>,
    loose: stepper::Substep,
    /// Entry that the last call used.
    pub(crate) current: usize,
    serial_next: u32,
    serial_used: u32,
    tick_next: u32,
    tick_used: u32,
    /// First serial number and first step of substeps that follow each other, since the last
    /// `forget_runs`.
    runs: Vec<(u32, u64)>,
    /// Time that counts as zero on the device \[s\].
    epoch: f64,
}

impl Slots {
    pub(crate) fn new() -> Self {
        Self {
            data: vec![Substep::default(); 2],
            plan: Vec::new(),
            loose: stepper::Substep::default(),
            current: 1,
            serial_next: 1,
            serial_used: 0,
            tick_next: 1,
            tick_used: 0,
            runs: Vec::new(),
            epoch: 0.0,
        }
    }

    pub(crate) fn data(&self) -> &[Substep] {
        &self.data
    }

    /// The entry for the state after the frame.
    pub(crate) fn closing(&self) -> usize {
        self.plan.len()
    }

    /// Starts to count anew, from `time` \[s\].
    pub(crate) fn restart(&mut self, time: f64) {
        self.epoch = time;
        self.serial_next = 1;
        self.serial_used = 0;
        self.runs.clear();
    }

    /// Fills the entries for a frame.
    pub(crate) fn fill(&mut self, plan: &FramePlan) {
        self.plan.clone_from(&plan.substeps);
        self.data.clear();
        let first = self.serial_next;
        let count = plan.substeps.len();
        let sets = plan.colliders.len() / plan.collider_count.max(1);
        for (index, substep) in plan.substeps.iter().enumerate() {
            let set = index.min(sets.saturating_sub(1));
            self.data.push(Substep {
                serial: first + index as u32,
                collider_first: (set * plan.collider_count) as u32,
                collider_count: plan.collider_count as u32,
                flags: if index + 1 == count { FLAG_COUNT_CONTACTS } else { 0 },
                ..self.common(substep)
            });
        }
        self.serial_next += count as u32;
        if let Some(substep) = plan.substeps.first() {
            self.runs.push((first, substep.step));
        }
        let closing = Substep {
            collider_first: (sets.saturating_sub(1) * plan.collider_count) as u32,
            collider_count: plan.collider_count as u32,
            ..self.data.last().copied().unwrap_or_default()
        };
        self.data.extend([closing, closing]);
        self.current = self.loose_index();
    }

    /// New contact ticks for all entries.
    pub(crate) fn ticks(&mut self) {
        for entry in &mut self.data {
            entry.contact_tick = self.tick_next;
            self.tick_next += 1;
        }
    }

    fn common(&self, substep: &stepper::Substep) -> Substep {
        Substep {
            wind: substep.wind_velocity.map(|component| component as f32),
            length: substep.length as f32,
            contact_recovery: SelfContact::recovery(substep.length) as f32,
            time: (substep.time - self.epoch) as f32,
            clock: substep.time as f32,
            anchor_offset: substep.anchor_offset.map(|component| component as f32),
            ..Substep::default()
        }
    }

    const fn loose_index(&self) -> usize {
        self.data.len() - 1
    }

    /// The entry for a substep, if it has one. With `fresh` its serial number must be higher than all
    /// that were used.
    pub(crate) fn find(&mut self, substep: &stepper::Substep, fresh: bool) -> Option<usize> {
        let is_current = match self.plan.get(self.current) {
            Some(planned) => planned == substep,
            None => self.current == self.loose_index() && self.loose == *substep,
        };
        if is_current && !fresh {
            return Some(self.current);
        }
        let index = substep.index;
        let usable = self.plan.get(index) == Some(substep)
            && (!fresh || self.data[index].serial > self.serial_used);
        if !usable {
            return None;
        }
        self.current = index;
        if fresh {
            self.serial_used = self.data[index].serial;
        }
        Some(index)
    }

    /// Makes the loose entry one for `substep`, or for another use of the current entry. It has to be
    /// written to the device then.
    pub(crate) fn loosen(&mut self, substep: Option<&stepper::Substep>) -> usize {
        let index = self.loose_index();
        let before = self.data[self.current];
        let mut entry = before;
        if let Some(substep) = substep {
            let planned = self.data.get(substep.index).filter(|_| substep.index < self.plan.len());
            let colliders = planned.copied().unwrap_or(self.data[self.closing()]);
            entry = Substep {
                collider_first: colliders.collider_first,
                collider_count: colliders.collider_count,
                ..self.common(substep)
            };
            self.loose = *substep;
            self.runs.push((self.serial_next, substep.step));
        } else if let Some(planned) = self.plan.get(self.current) {
            self.loose = *planned;
        }
        entry.serial = self.serial_next;
        self.serial_used = self.serial_next;
        self.serial_next += 1;
        entry.contact_tick = self.tick_next;
        self.tick_next += 1;
        entry.flags = FLAG_COUNT_CONTACTS;
        self.data[index] = entry;
        self.current = index;
        index
    }

    /// An entry for a search for candidates: its tick is higher than all that were used for that.
    pub(crate) fn for_candidates(&mut self) -> Option<usize> {
        let next = if self.current < self.plan.len() { self.current } else { 0 };
        let is_unused = |index: &usize| {
            *index < self.plan.len() && self.data[*index].contact_tick > self.tick_used
        };
        let index = [next, next + 1].into_iter().find(is_unused)?;
        self.current = index;
        Some(index)
    }

    /// Notes that an entry was used for such a search.
    pub(crate) fn candidates_used(&mut self, index: usize) {
        self.tick_used = self.tick_used.max(self.data[index].contact_tick);
    }

    /// The step that has this serial number.
    pub(crate) fn step_of(&self, serial: u32) -> Option<u64> {
        let run = self.runs.iter().rev().find(|(first, _)| *first <= serial)?;
        Some(run.1 + u64::from(serial - run.0))
    }

    /// Forgets runs but the last one: what they were kept for is known.
    pub(crate) fn forget_runs(&mut self) {
        self.runs.drain(..self.runs.len().saturating_sub(1));
    }
}
