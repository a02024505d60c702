//! The stages of contact of triangles: what [`DeviceContact`] asks of the device. A substep looks at it once for contacts, and once for
//! the certificate.

use std::sync::Arc;

use cloth_core::{
    Error, Integrator, Model, NewtonStart, Result,
    contact::{
        Candidate, ContactEquation, ContactLaw, ContactSet, ContactSlip, Contacts, Ghost,
        device::{
            DeviceContact, GROUP, MotionVector, PAIR_WORDS, PAIRS_MAX, PairAnswer, PairDevice,
            PairLook, PairTask, WaysFrom, pairs_of,
        },
    },
    stepper::Substep,
};

use super::{
    Stages,
    motion::{PROVEN, START},
};
use crate::{
    buffers::VECTOR_SIZE,
    dispatch::WORKGROUP,
    layout,
    tables::{spring_entries, spring_kinds},
    triangle_contact::{TABLE_HEAD, result_head, table},
};

impl Stages {
    /// Takes the memory for contact of triangles, if there is any.
    pub(super) fn triangles_prepare(&mut self) -> Result<()> {
        self.with_triangles(|stages, triangles| {
            let particles = stages.model.particle_count() as u64;
            let surface = triangles.surface_words();
            let surface: &[u8] = bytemuck::cast_slice(&surface);
            let nodes = u64::from(triangles.list.task.node_count);
            let boxes = 4 * VECTOR_SIZE * triangles.box_count() as u64;
            for (name, size, contents) in [
                ("surface", surface.len() as u64, Some(surface)),
                ("pair_task", size_of::<layout::PairTask>() as u64, None),
                ("pair_ways", 2 * VECTOR_SIZE * nodes, None),
                ("pair_references", 2 * VECTOR_SIZE * nodes, None),
                ("pair_boxes", boxes, None),
                ("contact_table", 4 * (TABLE_HEAD as u64 + particles + 1), None),
                ("contact_terms", VECTOR_SIZE, None),
            ] {
                stages.buffers.create(&stages.context, name, size, contents)?;
            }
            let task = triangles.list.task;
            stages.list_create(&task)?;
            stages.results_create(&task)?;
            for name in ["contact_pairs_list", "contact_geometry", "contact_certify"] {
                stages.kernel(name)?;
            }
            Ok(())
        })
        .map(drop)
    }

    /// Does something with contact of triangles, if there is any.
    fn with_triangles<R>(
        &mut self,
        work: impl FnOnce(&mut Self, &mut DeviceContact<f32>) -> Result<R>,
    ) -> Result<Option<R>> {
        let Some(mut triangles) = self.triangles.take() else { return Ok(None) };
        let outcome = work(self, &mut triangles);
        self.triangles = Some(triangles);
        outcome.map(Some)
    }

    /// `contact_pairs`.
    pub(crate) fn contact_pairs_find(&mut self, substep: &Substep) -> Result<()> {
        let model = Arc::clone(&self.model);
        self.with_triangles(|stages, triangles| triangles.pairs(&model, stages, substep)).map(drop)
    }

    /// `contact_geometry`.
    pub(crate) fn contact_geometry(
        &mut self,
        substep: &Substep,
        newton: NewtonStart,
    ) -> Result<()> {
        self.start_ensure()?;
        let law = ContactLaw::of(&self.model, &self.config, substep.length);
        self.with_triangles(|stages, triangles| triangles.geometry(stages, law, newton)).map(drop)
    }

    /// `contact_certify`.
    pub(crate) fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        self.start_ensure()?;
        let held = std::mem::take(&mut self.held);
        let model = Arc::clone(&self.model);
        let done = self
            .with_triangles(|stages, triangles| triangles.certify(&model, stages, substep, &held))
            .map(drop);
        self.held = held;
        done
    }

    /// `contact_certify` of an iterate.
    pub(crate) fn contact_certify_iterate(&mut self, substep: &Substep) -> Result<u64> {
        self.start_ensure()?;
        let held = std::mem::take(&mut self.held);
        let model = Arc::clone(&self.model);
        let changed = self.with_triangles(|stages, triangles| {
            triangles.certify_iterate(&model, stages, substep, &held)
        });
        self.held = held;
        Ok(changed?.unwrap_or_default())
    }

    /// `contact_forces`.
    pub(super) fn triangle_forces(&mut self) -> Result<()> {
        if self.triangles.as_ref().is_none_or(|triangles| !triangles.has_contacts) {
            return Ok(());
        }
        let items = (self.particle_count(), WORKGROUP);
        self.pair_kernel("contact_forces", "contact_forces_triangles", items)
    }

    /// Whether triangles can touch.
    pub(crate) const fn has_triangles(&self) -> bool {
        self.triangles.is_some()
    }

    /// Whether `contact_geometry` has found contacts.
    pub(crate) fn triangles_touch(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| triangles.touches())
    }

    /// All contacts as last computed.
    pub(crate) fn contacts_read(&self, out: &mut Contacts) {
        out.contacts.clear();
        if let Some(triangles) = &self.triangles {
            triangles.set.read(out);
        }
    }

    /// What friction remembers; `out` is resized.
    pub(crate) fn slips_read(&self, out: &mut Vec<ContactSlip>) {
        match &self.triangles {
            Some(triangles) => triangles.set.slips_read(out),
            None => out.clear(),
        }
    }

    /// Goes on with a model of other stitches, if the pairs of contact stay the same.
    pub(crate) fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        let has_constant_matrix = matches!(self.config.integrator, Integrator::SemiImplicit(_));
        let triangles = self.triangles.as_mut();
        if has_constant_matrix || !triangles.is_none_or(|all| all.stitches_set(model)) {
            return Ok(false);
        }
        let entries = spring_entries(model);
        self.write("spring_entries", 0, bytemuck::cast_slice(&entries))?;
        if self.buffers.has("spring_kinds") {
            let kinds = spring_kinds(model);
            self.write("spring_kinds", 0, bytemuck::cast_slice(&kinds))?;
        }
        self.model = Arc::clone(model);
        Ok(true)
    }

    /// What bodies have pinched; `out` is resized.
    pub(crate) fn ghosts_read(&self, out: &mut Vec<Ghost>) {
        out.clear();
        if let Some(triangles) = &self.triangles {
            out.extend_from_slice(triangles.ghosts());
        }
    }

    /// `ghosts_write`.
    pub(crate) fn ghosts_write(&mut self, ghosts: &[Ghost]) {
        if let Some(triangles) = &mut self.triangles {
            triangles.ghosts_set(ghosts);
        }
    }

    /// The pairs of the list, ascending.
    pub(crate) fn contact_list_read(&mut self, out: &mut Vec<Candidate>) -> Result<()> {
        out.clear();
        self.with_triangles(|stages, triangles| {
            let count = u64::from(triangles.list.task.pair_count);
            let words = stages.read_words::<u32>("pairs", PAIR_WORDS as u64 * count)?;
            out.extend(pairs_of(&words).map(|pair| pair.candidate));
            Ok(())
        })?;
        out.sort_unstable();
        Ok(())
    }

    /// Makes sure that it is known where the substep has started.
    fn start_ensure(&mut self) -> Result<()> {
        if self.buffers.get(START, 0, 0).is_err() { self.start_keep() } else { Ok(()) }
    }

    /// Makes a buffer for `count` pairs behind `head` words.
    fn pairs_create(&mut self, name: &'static str, head: usize, count: u32) -> Result<()> {
        let size = 4 * (head as u64 + PAIR_WORDS as u64 * u64::from(count));
        let limits = &self.context.limits;
        let max = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if size > max || count > PAIRS_MAX {
            let capacity = (max / 4 / PAIR_WORDS as u64).min(u64::from(PAIRS_MAX));
            let buffer = "pairs of triangles that may touch";
            return Err(Error::Overflow { buffer, needed: u64::from(count), capacity });
        }
        self.recorder.submit(&self.context)?;
        self.buffers.create(&self.context, name, size, None)?;
        self.bind_groups.clear();
        Ok(())
    }

    /// A kernel of contact of triangles.
    fn pair_kernel(
        &mut self,
        stage: &'static str,
        name: &'static str,
        items: (u32, u32),
    ) -> Result<()> {
        self.dispatch(stage, name, items, self.present, (0, 0))
    }

    fn task_write(&mut self, task: &PairTask<f32>) -> Result<()> {
        self.write("pair_task", 0, bytemuck::bytes_of(&layout::PairTask::from(*task)))
    }

    /// Puts the ways in place.
    fn ways_record(&mut self, task: &PairTask<f32>, from: WaysFrom) -> Result<()> {
        match from {
            WaysFrom::Device => Ok(()),
            WaysFrom::Velocities => {
                let items = (self.particle_count(), WORKGROUP);
                self.pair_kernel("contact_pairs", "contact_pairs_ahead", items)
            }
            WaysFrom::Substep | WaysFrom::Iterate => {
                let from = if from == WaysFrom::Iterate { PROVEN } else { START };
                let size = VECTOR_SIZE * self.model.particle_count() as u64;
                let ways = self.buffers.get("pair_ways", 0, 0)?;
                let start = self.buffers.get(from, 0, 0)?;
                let end = self.buffers.position(self.present);
                self.recorder.copy(&self.context, start, 0, ways, 0, size);
                let ends = VECTOR_SIZE * u64::from(task.node_count);
                self.recorder.copy(&self.context, end, 0, ways, ends, size);
                Ok(())
            }
        }
    }

    pub(super) fn vectors_read(
        &mut self,
        source: &wgpu::Buffer,
        out: &mut Vec<[f32; 4]>,
    ) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        self.read_part(source, 0, size, |bytes| {
            out.clear();
            out.extend_from_slice(bytemuck::cast_slice(bytes));
        })
    }
}

impl PairDevice<f32> for Stages {
    fn list_create(&mut self, task: &PairTask<f32>) -> Result<()> {
        self.pairs_create("pairs", 0, task.pair_capacity)
    }

    fn results_create(&mut self, task: &PairTask<f32>) -> Result<()> {
        self.pairs_create("pair_results", result_head(task), task.found_capacity)
    }

    fn ways_write(&mut self, first: usize, ways: &[[f32; 4]]) -> Result<()> {
        self.write("pair_ways", VECTOR_SIZE * first as u64, bytemuck::cast_slice(ways))
    }

    fn nodes_write(&mut self, start: &[[f32; 4]], end: Option<&[[f32; 4]]>) -> Result<()> {
        let behind = VECTOR_SIZE * self.model.particle_count() as u64;
        let size = VECTOR_SIZE * start.len() as u64;
        self.write("pair_ways", behind, bytemuck::cast_slice(start))?;
        let write = |end| self.write("pair_ways", 2 * behind + size, bytemuck::cast_slice(end));
        end.map_or(Ok(()), write)
    }

    fn look(
        &mut self,
        task: &PairTask<f32>,
        ways: WaysFrom,
        look: PairLook,
        expected: usize,
        out: &mut PairAnswer<f32>,
    ) -> Result<()> {
        self.task_write(task)?;
        self.write("pair_results", 0, bytemuck::bytes_of(&0_u32))?;
        self.ways_record(task, ways)?;
        self.pair_kernel("contact_pairs", "contact_pairs_moved", (2 * task.moved_blocks, 1))?;
        let kernel = match look {
            PairLook::Moved => None,
            PairLook::Near => Some("contact_geometry"),
            PairLook::Unproven => Some("contact_certify"),
        };
        if let Some(kernel) = kernel {
            self.pair_kernel(kernel, kernel, (task.pair_count, WORKGROUP))?;
        }
        let head = result_head(task);
        let capacity = task.found_capacity as usize;
        let words = |count: usize| (head + PAIR_WORDS * count) as u64;
        let mut read = self.read_words::<u32>("pair_results", words(expected.min(capacity)))?;
        out.found = read[0];
        let count = (out.found as usize).min(capacity);
        if (read.len() as u64) < words(count) {
            read = self.read_words("pair_results", words(count))?;
        }
        out.moved.clear();
        out.moved.extend(read[4..head].iter().map(|&word| f32::from_bits(word)));
        out.pairs = head..head + PAIR_WORDS * count;
        out.words = read;
        Ok(())
    }

    fn references_take(&mut self, task: &PairTask<f32>) -> Result<()> {
        let size = 2 * VECTOR_SIZE * u64::from(task.node_count);
        let [ways, references] =
            [self.buffers.get("pair_ways", 0, 0)?, self.buffers.get("pair_references", 0, 0)?];
        self.recorder.copy(&self.context, ways, 0, references, 0, size);
        Ok(())
    }

    fn boxes_fit(&mut self, task: &PairTask<f32>) -> Result<()> {
        self.task_write(task)?;
        self.pair_kernel("contact_pairs", "contact_pairs_boxes", (task.group_count, WORKGROUP))?;
        self.pair_kernel("contact_pairs", "contact_pairs_tree", (task.group_count, 1))
    }

    fn list_fill(&mut self, task: &PairTask<f32>) -> Result<u32> {
        self.task_write(task)?;
        self.write("pair_results", 4, bytemuck::bytes_of(&0_u32))?;
        let items = ((GROUP * GROUP) as u32 * task.listing_groups(), WORKGROUP);
        self.pair_kernel("contact_pairs", "contact_pairs_list", items)?;
        Ok(self.read_words::<u32>("pair_results", 2)?[1])
    }

    fn motion_read(&mut self, wanted: &mut [(MotionVector, &mut Vec<[f32; 4]>)]) -> Result<()> {
        let from = |(which, _): &(MotionVector, _)| match which {
            MotionVector::Position => Ok(self.buffers.position(self.present).clone()),
            MotionVector::Velocity => Ok(self.buffers.velocity(self.present).clone()),
            MotionVector::Start => self.buffers.get(START, 0, 0).cloned(),
            MotionVector::Iterate => self.buffers.get(PROVEN, 0, 0).cloned(),
        };
        let sources = wanted.iter().map(from).collect::<Result<Vec<_>>>()?;
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        self.read_vectors(&sources.iter().collect::<Vec<_>>(), size, |part, bytes| {
            wanted[part].1.clear();
            wanted[part].1.extend_from_slice(bytemuck::cast_slice(bytes));
        })
    }

    fn motion_write(&mut self, position: &[[f32; 4]], velocity: &[[f32; 4]]) -> Result<()> {
        self.in_place()?;
        self.recorder.submit(&self.context)?;
        let queue = &self.context.queue;
        queue.write_buffer(self.buffers.position(self.present), 0, bytemuck::cast_slice(position));
        queue.write_buffer(self.buffers.velocity(self.present), 0, bytemuck::cast_slice(velocity));
        Ok(())
    }

    fn contacts_write(
        &mut self,
        set: &ContactSet<f32>,
        equation: impl Fn(usize) -> ContactEquation<f32> + Sync,
        newton: NewtonStart,
    ) -> Result<()> {
        let mut words = std::mem::take(&mut self.contact_words);
        table(set, equation, (self.model.particle_count(), newton), &mut words);
        // There are more of them each time while cloth falls on something.
        let size = 4 * words.len() as u64;
        let limits = &self.context.limits;
        let max = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let room = (size + size / 4).next_multiple_of(16);
        let room = if room <= max { room } else { size };
        let contents = bytemuck::cast_slice(&words);
        let written = self.write_growing_to("contact_table", contents, room);
        self.contact_words = words;
        written?;
        self.crowd = set.is_crowded().then_some(set.stencils().len() as u32);
        let places = if self.crowd.is_some() { set.rows().1.len() as u64 } else { 0 };
        let size = self.buffers.get("contact_terms", 0, 0).map_or(0, wgpu::Buffer::size);
        if size < VECTOR_SIZE * places {
            self.recorder.submit(&self.context)?;
            let room = VECTOR_SIZE * (places + places / 4);
            self.buffers.create(&self.context, "contact_terms", room.min(max), None)?;
            self.bind_groups.clear();
        }
        Ok(())
    }
}
