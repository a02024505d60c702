//! What the device found out, and doing a frame again if that is what it found out.

use cloth_core::{ContactStatistics, DeferredOutcome, Error, Measures, Result, State};

use super::{SMALL_SIZE, SMALL_SOLVE, SMALL_STATUS, Stages};
use crate::{
    buffers::{MEASURE_SIZE, VECTOR_SIZE},
    contact::{Command, OpenFrame},
    dispatch::{GROUP, MEASURE_BLOCK},
    figures::Figures,
    layout::{INVALID_LIST, INVALID_OVERFLOW, STOPPED_NEVER, Solve, Status},
};

/// Times that a frame is done again before giving up: each time the buffer is larger.
const ATTEMPTS_MAX: u32 = 24;

impl Stages {
    /// Makes sure that the present state is the right one.
    pub(crate) fn settle(&mut self) -> Result<()> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        if self.open.is_none() {
            return Ok(());
        }
        self.finish(false)
    }

    pub(crate) fn measure(&mut self) -> Result<Measures> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        self.finish(true)?;
        let measures = self.figures.map(|figures| figures.measures).unwrap_or_default();
        let stopped = self.status.stopped;
        let non_finite_step =
            if stopped == STOPPED_NEVER { None } else { self.slots.step_of(stopped) };
        if stopped == STOPPED_NEVER {
            self.slots.forget_runs();
        }
        Ok(Measures { non_finite_step, ..measures })
    }

    pub(crate) fn contact_statistics(&mut self) -> Result<ContactStatistics> {
        if let Some(triangles) = &mut self.triangles {
            return Ok(triangles.statistics_take());
        }
        if self.contact.is_none() {
            return Ok(ContactStatistics::default());
        }
        if self.figures.is_none() || self.open.is_some() {
            self.measure()?;
        }
        let contacts = self.figures.map_or(0, |figures| figures.contacts);
        let rebuilds = self.status.contact_rebuilds.saturating_sub(self.rebuilds_reported);
        self.rebuilds_reported = self.status.contact_rebuilds;
        Ok(ContactStatistics {
            contacts,
            candidates: u64::from(self.status.contact_listed) * u64::from(GROUP * GROUP),
            rebuilds,
            ..ContactStatistics::default()
        })
    }

    /// Waits for the device, and does the open frames again until they are good.
    fn finish(&mut self, measure: bool) -> Result<()> {
        if let Some(open) = &mut self.open {
            open.question = None;
        }
        for attempt in 1..=ATTEMPTS_MAX {
            self.status_read(measure)?;
            if self.open.is_none() || !self.frame_repeat(attempt)? {
                self.open = None;
                return Ok(());
            }
        }
        self.open = None;
        Err(Error::Overflow {
            buffer: "contact candidates",
            needed: u64::from(self.status.contact_needed),
            capacity: self.contact.as_ref().map_or(0, |policy| u64::from(policy.sizes.entries)),
        })
    }

    /// Reads the status, and the figures of the present state if they are wanted.
    fn status_read(&mut self, measure: bool) -> Result<()> {
        if measure {
            let slot = self.slots.closing();
            let items = (self.particle_count(), MEASURE_BLOCK);
            self.dispatch("measure", "measure", items, self.present, (slot, 0))?;
            if self.element_count() > 0 {
                self.over_folds("measure", "bending_forces_folds", slot)?;
                let items = (self.element_count(), MEASURE_BLOCK);
                self.dispatch("measure", "measure_fabric", items, self.present, (slot, 0))?;
            }
            self.dispatch("measure", "measure_total", (1, 1), self.present, (0, 0))?;
            let result = self.buffers.get("measure_result", 0, 0)?;
            self.recorder.copy(&self.context, result, 0, self.small.buffer(), 0, MEASURE_SIZE);
        }
        let status = self.buffers.get("status", 0, 0)?;
        let size = size_of::<Status>() as u64;
        self.recorder.copy(&self.context, status, 0, self.small.buffer(), SMALL_STATUS, size);
        if self.buffers.has("solve") {
            let solve = self.buffers.get("solve", 0, 0)?;
            let size = size_of::<Solve>() as u64;
            self.recorder.copy(&self.context, solve, 0, self.small.buffer(), SMALL_SOLVE, size);
        }
        self.recorder.submit(&self.context)?;
        let model = &self.model;
        let (figures, status, solve) = self.small.read(&self.context, SMALL_SIZE, |bytes| {
            let [status, solve] = [SMALL_STATUS, SMALL_SOLVE].map(|at| &bytes[at as usize..]);
            let status = bytemuck::pod_read_unaligned(&status[..size_of::<Status>()]);
            (Figures::new(model, bytes), status, bytemuck::pod_read_unaligned(solve))
        })?;
        self.status = status;
        self.solve = solve;
        self.figures = if measure { Some(figures) } else { None };
        Ok(())
    }

    /// Gives the device what it lacked in the open frame; whether it lacked anything.
    fn shortage_mend(&mut self, attempt: u32) -> Result<bool> {
        let invalid = self.status.invalid;
        let mut lacked = self.solve_policy.as_mut().is_some_and(|policy| policy.grow(invalid));
        if let Some(policy) = &mut self.contact {
            let limits = &self.context.limits;
            let max = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            // With an interval of one only numbers that are not finite count as too far.
            let is_broken = invalid & INVALID_LIST != 0 && policy.interval > 1;
            if invalid & INVALID_OVERFLOW != 0 {
                let before = policy.sizes;
                policy.grow(&self.status, max)?;
                let sizes = policy.sizes;
                if sizes.near > before.near {
                    let size = VECTOR_SIZE * sizes.row_words();
                    self.buffers.create(&self.context, "group_rows", size, None)?;
                }
                if sizes.entries > before.entries {
                    let size = 4 * u64::from(sizes.entries);
                    self.buffers.create(&self.context, "contact_entries", size, None)?;
                    if self.buffers.has("contact_factors") {
                        self.contact_factors_create()?;
                    }
                }
                self.bind_groups.clear();
                lacked = true;
            } else if is_broken {
                policy.list_was_broken(attempt);
                lacked = true;
            } else if !lacked {
                for _ in self.open.iter().flat_map(|open| &open.frames) {
                    policy.frame_was_good();
                }
            }
        }
        Ok(lacked)
    }

    /// Books what the open frame did, as it stands.
    fn frame_book(&mut self) -> Result<()> {
        if !self.buffers.has("solve") {
            return Ok(());
        }
        let solve = self.solve;
        if let Some(policy) = &mut self.solve_policy {
            policy.frame_was_good(&solve);
        }
        self.solve_log_take(&solve)?;
        if self.status.broken != STOPPED_NEVER {
            self.deferred.broken = self.slots.step_of(self.status.broken);
            self.status.broken = STOPPED_NEVER;
            let offset = std::mem::offset_of!(Status, broken) as u64;
            self.write("status", offset, bytemuck::bytes_of(&STOPPED_NEVER))?;
        }
        Ok(())
    }

    /// What came of recorded substeps.
    pub(crate) fn deferred_outcome(&mut self) -> Result<DeferredOutcome> {
        if self.solve_policy.is_some() {
            self.settle()?;
        }
        Ok(std::mem::take(&mut self.deferred))
    }

    /// Does the open frame again if it cannot be trusted; whether it did.
    fn frame_repeat(&mut self, attempt: u32) -> Result<bool> {
        if !self.shortage_mend(attempt)? {
            self.frame_book()?;
            return Ok(false);
        }
        let Some(open) = &mut self.open else { return Ok(false) };
        let frames = std::mem::take(&mut open.frames);
        self.present = open.start;
        self.semi_implicit.length = None;
        // A frame that was tried began with a device that had not stopped, or it would have been good.
        self.status_reset(STOPPED_NEVER)?;
        self.solve_log_reset()?;
        let mut commands = frames.iter().flat_map(|frame| &frame.commands);
        if commands.any(|command| matches!(command, Command::ColliderConstraints(_))) {
            self.constrained_reset()?;
        }
        self.rebuilds_reported = 0;
        self.impulses_copy(["collider_impulses_of_frame", "collider_impulses"])?;
        self.contact_constants_write()?;
        let was_batch = std::mem::replace(&mut self.is_batch, true);
        let outcome = frames.iter().try_for_each(|frame| self.frame_encode(frame));
        self.is_batch = was_batch;
        if let Some(open) = &mut self.open {
            open.frames = frames;
        }
        outcome.map(|()| true)
    }

    /// Records a frame that was recorded before.
    fn frame_encode(&mut self, frame: &OpenFrame) -> Result<()> {
        self.slots.clone_from(&frame.slots);
        self.slots_write()?;
        if let Some(plan) = &frame.plan {
            self.colliders_write(plan)?;
        }
        frame.commands.iter().try_for_each(|command| self.encode(command))
    }

    pub(crate) fn contact_pairs(&mut self, out: &mut Vec<[u32; 2]>) -> Result<()> {
        out.clear();
        let contact = self.model.self_contact().filter(|contact| !contact.is_of_triangles());
        let Some(contact) = contact else { return Ok(()) };
        let squared = (contact.distance as f32) * (contact.distance as f32);
        self.execute(Command::ContactCandidates)?;
        let mut state = State::default();
        self.state_read(&mut state)?;
        let count = self.model.particle_count();
        let rows: Vec<[u32; 2]> = self.read_words("contact_rows", 2 * count as u64)?;
        let used = rows.iter().map(|row| u64::from(row[0] + row[1])).max().unwrap_or(0);
        let entries: Vec<u32> = self.read_words("contact_entries", used)?;
        let position = |particle: usize| state.positions[particle].map(|c| c as f32);
        for (particle, [first, length]) in rows.into_iter().enumerate() {
            let x = position(particle);
            for &partner in &entries[first as usize..(first + length) as usize] {
                let y = position(partner as usize);
                let [dx, dy, dz] = [x[0] - y[0], x[1] - y[1], x[2] - y[2]];
                let is_later = partner as usize > particle;
                if is_later && dz.mul_add(dz, dy.mul_add(dy, dx * dx)) < squared {
                    out.push([particle as u32, partner]);
                }
            }
        }
        Ok(())
    }

    /// The first `words` words of a buffer.
    pub(super) fn read_words<T: bytemuck::Pod>(
        &mut self,
        name: &str,
        words: u64,
    ) -> Result<Vec<T>> {
        let buffer = self.buffers.get(name, 0, 0)?.clone();
        let size = 4 * words;
        let mut contents = Vec::new();
        if size > 0 {
            self.read_vectors(&[&buffer], size, |_, bytes| {
                contents = bytemuck::pod_collect_to_vec(bytes);
            })?;
        }
        Ok(contents)
    }

    /// The present state for others on the same device.
    pub(crate) fn device_buffers(&mut self) -> Result<crate::DeviceBuffers> {
        self.vertex_normals()?;
        self.recorder.submit(&self.context)?;
        Ok(crate::DeviceBuffers {
            device: self.context.device.clone(),
            queue: self.context.queue.clone(),
            positions: self.buffers.position(self.present).clone(),
            velocities: self.buffers.velocity(self.present).clone(),
            normals: self.buffers.get("normals", 0, 0)?.clone(),
        })
    }
}
