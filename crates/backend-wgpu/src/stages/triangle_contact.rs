//! The stages of contact of triangles: one look at the device for contacts, and one for the certificate, in each substep.

use cloth_core::{
    Error, NewtonStart, Result,
    contact::{
        Certifier, ContactLaw, ContactMotion, Contacts, PairSearch, UnprovenPair, Ways,
        certificate_distance,
    },
    stepper::Substep,
};

use super::{Stages, motion::START};
use crate::{
    buffers::VECTOR_SIZE,
    dispatch::WORKGROUP,
    layout::{TASK_MARKED, TASK_NEW},
    triangle_contact::{Moved, PAIR_WORDS, TABLE_HEAD, TriangleContact, pairs_of, vector},
};

/// Pairs of a list at most, as in `contact_pairs_list.wgsl`.
const PAIRS_MAX: u32 = 1 << 28;

/// Where the ways come from that kernels look at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WaysFrom {
    /// The present positions and velocities.
    Velocities,
    /// The start of the substep and the present positions.
    Substep,
    /// They are on the device already.
    Device,
}

/// What a look at the device has found.
struct Look {
    /// Starts and ends.
    moved: [Moved; 2],
    found: Vec<UnprovenPair>,
}

impl Look {
    fn is_finite(&self) -> bool {
        self.moved.iter().all(Moved::is_finite)
    }

    fn holds(&self, reach: f32, distance: f32) -> bool {
        self.moved.iter().all(|moved| moved.holds(reach, distance))
    }
}

impl Stages {
    /// Takes the memory for contact of triangles, if there is any.
    pub(super) fn triangles_prepare(&mut self) -> Result<()> {
        let Some(triangles) = self.triangles.take() else { return Ok(()) };
        let particles = self.model.particle_count() as u64;
        let surface = triangles.surface_words();
        let surface: &[u8] = bytemuck::cast_slice(&surface);
        let task = triangles.task;
        for (name, size, contents) in [
            ("surface", surface.len() as u64, Some(surface)),
            ("pair_task", size_of_val(&task) as u64, None),
            ("pair_ways", 2 * VECTOR_SIZE * particles, None),
            ("pair_references", 2 * VECTOR_SIZE * particles, None),
            ("pair_boxes", 2 * VECTOR_SIZE * triangles.box_count(), None),
            ("contact_table", 4 * (TABLE_HEAD as u64 + particles + 1), None),
        ] {
            self.buffers.create(&self.context, name, size, contents)?;
        }
        self.triangles = Some(triangles);
        self.with_triangles(|stages, triangles| {
            stages.list_create(triangles)?;
            stages.results_create(triangles)
        })?;
        for name in ["contact_pairs_list", "contact_geometry", "contact_certify"] {
            self.kernel(name)?;
        }
        Ok(())
    }

    /// Does something with contact of triangles, if there is any.
    fn with_triangles<R>(
        &mut self,
        work: impl FnOnce(&mut Self, &mut TriangleContact) -> Result<R>,
    ) -> Result<Option<R>> {
        let Some(mut triangles) = self.triangles.take() else { return Ok(None) };
        let outcome = work(self, &mut triangles);
        self.triangles = Some(triangles);
        outcome.map(Some)
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

    fn list_create(&mut self, triangles: &TriangleContact) -> Result<()> {
        self.pairs_create("pairs", 0, triangles.task.pair_capacity)
    }

    fn results_create(&mut self, triangles: &TriangleContact) -> Result<()> {
        self.pairs_create("pair_results", triangles.result_head(), triangles.task.found_capacity)
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

    fn task_write(&mut self, triangles: &TriangleContact) -> Result<()> {
        self.write("pair_task", 0, bytemuck::bytes_of(&triangles.task))
    }

    /// Puts the ways in place.
    fn ways_record(&mut self, from: WaysFrom) -> Result<()> {
        match from {
            WaysFrom::Device => Ok(()),
            WaysFrom::Velocities => {
                let items = (self.particle_count(), WORKGROUP);
                self.pair_kernel("contact_pairs", "contact_pairs_ahead", items)
            }
            WaysFrom::Substep => {
                let size = VECTOR_SIZE * self.model.particle_count() as u64;
                let ways = self.buffers.get("pair_ways", 0, 0)?;
                let start = self.buffers.get(START, 0, 0)?;
                let end = self.buffers.position(self.present);
                self.recorder.copy(&self.context, start, 0, ways, 0, size);
                self.recorder.copy(&self.context, end, 0, ways, size, size);
                Ok(())
            }
        }
    }

    /// Asks the device how far particles have moved, and which pairs of the list `kernel` finds.
    fn look(
        &mut self,
        triangles: &mut TriangleContact,
        kernel: &'static str,
        from: WaysFrom,
    ) -> Result<Look> {
        loop {
            self.task_write(triangles)?;
            self.write("pair_results", 0, bytemuck::bytes_of(&0_u32))?;
            self.ways_record(from)?;
            let blocks = 2 * triangles.task.moved_blocks;
            self.pair_kernel("contact_pairs", "contact_pairs_moved", (blocks, 1))?;
            if triangles.has_list && triangles.task.pair_count > 0 {
                let items = (triangles.task.pair_count, WORKGROUP);
                self.pair_kernel(kernel, kernel, items)?;
            }
            let head = triangles.result_head();
            let capacity = triangles.task.found_capacity as usize;
            let mut words = self.results_read(head, triangles.expected.min(capacity))?;
            let count = words[0] as usize;
            if count > capacity {
                triangles.task.found_capacity = room(words[0]);
                self.results_create(triangles)?;
                continue;
            }
            if words.len() < head + PAIR_WORDS * count {
                words = self.results_read(head, count)?;
            }
            // Down slowly, as looks for contacts and for proofs take turns.
            triangles.expected = (count + count / 4).max(triangles.expected / 8 * 7).max(64);
            let found = &words[head..head + PAIR_WORDS * count];
            let moved = &words[4..head];
            let (starts, ends) = moved.split_at(moved.len() / 2);
            return Ok(Look {
                moved: [Moved::of(starts), Moved::of(ends)],
                found: pairs_of(found).collect(),
            });
        }
    }

    fn results_read(&mut self, head: usize, count: usize) -> Result<Vec<u32>> {
        self.read_words("pair_results", (head + PAIR_WORDS * count) as u64)
    }

    /// Builds the list for the ways that are on the device: for both their ends and all between, the second ones less a common motion
    /// if `is_common`.
    fn list_build(&mut self, triangles: &mut TriangleContact, is_common: bool) -> Result<()> {
        let size = 2 * VECTOR_SIZE * self.model.particle_count() as u64;
        let [ways, references] =
            [self.buffers.get("pair_ways", 0, 0)?, self.buffers.get("pair_references", 0, 0)?];
        self.recorder.copy(&self.context, ways, 0, references, 0, size);
        triangles.has_list = false;
        if is_common {
            let look = self.look(triangles, "contact_certify", WaysFrom::Device)?;
            triangles.task.drift = look.moved[1].centre();
            self.task_write(triangles)?;
            let items = (self.particle_count(), WORKGROUP);
            self.pair_kernel("contact_pairs", "contact_pairs_reference", items)?;
        }
        let groups = (triangles.task.group_count, WORKGROUP);
        self.pair_kernel("contact_pairs", "contact_pairs_boxes", groups)?;
        self.pair_kernel("contact_pairs", "contact_pairs_tree", (1, 1))?;
        loop {
            self.task_write(triangles)?;
            self.write("pair_results", 4, bytemuck::bytes_of(&0_u32))?;
            self.pair_kernel("contact_pairs", "contact_pairs_list", groups)?;
            let listed = self.read_words::<u32>("pair_results", 2)?[1];
            if listed <= triangles.task.pair_capacity {
                triangles.task.pair_count = listed;
                triangles.has_list = true;
                triangles.statistics.rebuilds += 1;
                return Ok(());
            }
            triangles.task.pair_capacity = room(listed);
            self.list_create(triangles)?;
        }
    }

    /// `contact_pairs`: completes the list for contacts at the present positions, and finds the pairs that may touch.
    pub(crate) fn contact_pairs_find(&mut self, substep: &Substep) -> Result<()> {
        self.with_triangles(|stages, triangles| {
            triangles.task.length = substep.length as f32;
            triangles.near.clear();
            let (kernel, distance) = ("contact_geometry", triangles.task.distance);
            let mut look = stages.look(triangles, kernel, WaysFrom::Velocities)?;
            if !look.is_finite() {
                // Whoever looks for divergence says so.
                return Ok(());
            }
            if !(triangles.has_list && look.moved[0].holds(triangles.task.reach, distance)) {
                stages.list_build(triangles, true)?;
                look = stages.look(triangles, kernel, WaysFrom::Device)?;
            }
            triangles.near = look.found;
            Ok(())
        })
        .map(|_| ())
    }

    /// `contact_geometry`, after `contact_pairs` of the same positions: contacts and what they do.
    pub(crate) fn contact_geometry(
        &mut self,
        substep: &Substep,
        newton: NewtonStart,
    ) -> Result<()> {
        if self.buffers.get(START, 0, 0).is_err() {
            self.start_keep()?;
        }
        self.with_triangles(|stages, triangles| {
            let integrator = &stages.config.integrator;
            let law = ContactLaw::new(integrator, substep.length, stages.config.time_step);
            if triangles.near.is_empty() {
                triangles.set.stencils_set(law, Vec::new());
                triangles.set.states_set(Vec::new());
                return stages.table_write(triangles, newton);
            }
            stages.motion_read(triangles)?;
            let TriangleContact { surface, set, motion, near, .. } = &mut *triangles;
            let position = |i: u32| vector(&motion.position[i as usize]);
            let found = near.iter().filter_map(|pair| surface.contact(pair.candidate, position));
            let found = found.collect();
            set.stencils_set(law, found);
            let motion = ContactMotion {
                position,
                velocity: |i: u32| vector(&motion.velocity[i as usize]),
                start: |i: u32| vector(&motion.start[i as usize]),
                inverse_mass: |i: u32| motion.position[i as usize][3],
            };
            let all = 0..set.stencils().len();
            let states = all.filter_map(|contact| set.state(contact, &motion, newton)).collect();
            set.states_set(states);
            stages.table_write(triangles, newton)
        })
        .map(|_| ())
    }

    /// Whether `contact_geometry` has found contacts.
    pub(crate) fn triangles_touch(&self) -> bool {
        self.triangles.as_ref().is_some_and(|triangles| !triangles.set.stencils().is_empty())
    }

    /// Reads positions, velocities and the start of the substep.
    fn motion_read(&mut self, triangles: &mut TriangleContact) -> Result<()> {
        let velocity = self.buffers.velocity(self.present).clone();
        self.ends_read(triangles)?;
        self.vectors_read(&velocity, &mut triangles.motion.velocity)
    }

    /// Reads positions, and the start of the substep.
    fn ends_read(&mut self, triangles: &mut TriangleContact) -> Result<()> {
        let position = self.buffers.position(self.present).clone();
        let start = self.buffers.get(START, 0, 0)?.clone();
        self.vectors_read(&position, &mut triangles.motion.position)?;
        self.vectors_read(&start, &mut triangles.motion.start)
    }

    fn vectors_read(&mut self, source: &wgpu::Buffer, out: &mut Vec<[f32; 4]>) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        self.read_part(source, 0, size, |bytes| {
            out.clear();
            out.extend_from_slice(bytemuck::cast_slice(bytes));
        })
    }

    /// Hands the contacts to the device.
    fn table_write(&mut self, triangles: &mut TriangleContact, newton: NewtonStart) -> Result<()> {
        let has_table = !triangles.set.stencils().is_empty();
        if !(has_table || triangles.has_table) {
            return Ok(());
        }
        triangles.has_table = has_table;
        let table = triangles.table(self.model.particle_count(), newton);
        self.write_growing("contact_table", bytemuck::cast_slice(&table))
    }

    /// `contact_forces`.
    pub(super) fn triangle_forces(&mut self) -> Result<()> {
        if self.triangles.as_ref().is_none_or(|triangles| !triangles.has_table) {
            return Ok(());
        }
        let items = (self.particle_count(), WORKGROUP);
        self.pair_kernel("contact_forces", "contact_forces_triangles", items)
    }

    /// `contact_certify`: shortens the ways of particles that are free, where the device has no proof.
    pub(crate) fn contact_certify(&mut self, substep: &Substep) -> Result<()> {
        if self.buffers.get(START, 0, 0).is_err() {
            self.start_keep()?;
        }
        self.with_triangles(|stages, triangles| {
            let is_proven = stages.is_proven(triangles)?;
            let has_contacts = !triangles.set.stencils().is_empty();
            if !is_proven || has_contacts {
                stages.ends_read(triangles)?;
            }
            if !is_proven {
                stages.shorten(triangles, substep.length as f32)?;
            }
            let TriangleContact { set, motion, .. } = triangles;
            let [position, start] = [&motion.position, &motion.start];
            set.settle(|i| vector(&position[i as usize]), |i| vector(&start[i as usize]));
            Ok(())
        })
        .map(|_| ())
    }

    /// Whether the device proves all pairs, and nothing else is to be looked at. What is not finite is left to whoever looks for
    /// divergence.
    fn is_proven(&mut self, triangles: &mut TriangleContact) -> Result<bool> {
        if triangles.certifier.must_look() {
            return Ok(false);
        }
        let mut from = WaysFrom::Substep;
        triangles.task.flags = 0;
        triangles.task.delta = triangles.task.delta.max(certificate_distance(0.0));
        loop {
            let look = self.look(triangles, "contact_certify", from)?;
            from = WaysFrom::Device;
            if !look.is_finite() {
                return Ok(true);
            }
            let largest = look.moved[0].largest().max(look.moved[1].largest());
            let delta = certificate_distance(largest);
            if delta > triangles.task.delta {
                // A little more, as they go on.
                triangles.task.delta = certificate_distance(1.1 * largest);
                continue;
            }
            let distance = 2.0 * triangles.task.delta;
            if triangles.has_list && look.holds(triangles.task.reach, distance) {
                return Ok(look.found.is_empty());
            }
            self.list_build(triangles, true)?;
        }
    }

    /// Shortens ways, on the host, with the pairs that the device finds.
    fn shorten(&mut self, triangles: &mut TriangleContact, length: f32) -> Result<()> {
        let start: Vec<_> = triangles.motion.start.iter().map(vector).collect();
        let mut end: Vec<_> = triangles.motion.position.iter().map(vector).collect();
        let mut certifier = std::mem::replace(&mut triangles.certifier, Certifier::new(0));
        let held = self.held.clone();
        let mut search = DeviceSearch { stages: self, triangles };
        let outcome = certifier.certify(&mut search, &start, &mut end, |i: u32| held[i as usize]);
        triangles.certifier = certifier;
        let changed = outcome?;
        triangles.statistics.truncated += changed;
        if changed == 0 {
            return Ok(());
        }
        let velocity = self.buffers.velocity(self.present).clone();
        self.vectors_read(&velocity, &mut triangles.motion.velocity)?;
        let motion = &mut triangles.motion;
        let moved = motion.position.iter_mut().zip(&mut motion.velocity).zip(&end).zip(&held);
        for (((wanted, velocity), end), _) in moved.filter(|(_, held)| !**held) {
            for (k, &end) in end.iter().enumerate() {
                velocity[k] += (end - wanted[k]) / length;
                wanted[k] = end;
            }
        }
        self.in_place()?;
        self.recorder.submit(&self.context)?;
        let queue = &self.context.queue;
        let [position, velocity] =
            [self.buffers.position(self.present), self.buffers.velocity(self.present)];
        queue.write_buffer(position, 0, bytemuck::cast_slice(&motion.position));
        queue.write_buffer(velocity, 0, bytemuck::cast_slice(&motion.velocity));
        Ok(())
    }

    /// All contacts as last computed.
    pub(crate) fn contacts_read(&self, out: &mut Contacts) {
        out.contacts.clear();
        if let Some(triangles) = &self.triangles {
            triangles.set.read(out);
        }
    }
}

/// Room for so many, and some more.
fn room(needed: u32) -> u32 {
    needed.saturating_add(needed / 2).min(PAIRS_MAX).max(needed)
}

/// The list on the device as a search that builds it when it does not hold.
struct DeviceSearch<'a> {
    stages: &'a mut Stages,
    triangles: &'a mut TriangleContact,
}

impl PairSearch<f32> for DeviceSearch<'_> {
    fn unproven(
        &mut self,
        ways: &Ways<'_, f32>,
        marked: Option<&[bool]>,
        out: &mut Vec<UnprovenPair>,
    ) -> Result<()> {
        let Self { stages, triangles } = self;
        let full = |x: &[f32; 3], w: f32| [x[0], x[1], x[2], w];
        let is_marked = |i: usize| marked.is_some_and(|marked| marked[i]);
        let starts = ways.start.iter().map(|x| full(x, 0.0));
        let ends = ways.end.iter().enumerate();
        let ends = ends.map(|(i, x)| full(x, f32::from(u8::from(is_marked(i)))));
        let vectors: Vec<[f32; 4]> = starts.chain(ends).collect();
        stages.write("pair_ways", 0, bytemuck::cast_slice(&vectors))?;
        let flags = [(marked.is_some(), TASK_MARKED), (ways.is_new, TASK_NEW)];
        triangles.task.flags = flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum();
        triangles.task.delta = ways.delta;
        let mut look = stages.look(triangles, "contact_certify", WaysFrom::Device)?;
        let distance = ways.delta + ways.delta;
        if !(triangles.has_list && look.holds(triangles.task.reach, distance)) {
            // Marked particles lag behind the others, which the next rounds will make worse: then boxes are around whole ways.
            stages.list_build(triangles, marked.is_none())?;
            look = stages.look(triangles, "contact_certify", WaysFrom::Device)?;
        }
        out.extend(look.found);
        Ok(())
    }
}
