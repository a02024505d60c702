//! The composite stage `explicit_substep`: substeps are collected, and done together.

use cloth_core::{
    ColliderShape, Real, Result,
    stepper::{ColliderState, FramePlan, Substep},
};

use super::{CudaKernels, control_forces::Kick};
use crate::{
    chain::{Chain, Link},
    forms::FrameForm,
    layout::{ColliderData, CudaReal, SubstepData},
    memory::Memory,
    queue::{Buffer, Launch, argument},
};

/// Where nothing is \[m\].
const FAR_BELOW: f64 = -1e30;
/// Substeps that are collected at most.
const BATCH_MAX: usize = 1024;
/// Threads of a block of `strain_limit_sweeps`.
const SWEEP_THREADS: u32 = 256;

/// What is to be done, and what may have to be done again.
pub(super) struct FrameQueue<T> {
    /// Not yet handed over.
    pending: Vec<QueuedSubstep<T>>,
    /// What forces from outside do before the substep that comes next.
    pub(super) kick: Option<Kick<T>>,
    /// Handed over, but the candidate list may have been too short.
    open: Option<OpenFrame<T>>,
    /// The state at the start of an open frame, or where it may be put.
    saved: Option<[Buffer<[T; 4]>; 2]>,
    /// The launch that comes next is to leave the state that it begins with as it is.
    keeps_first: bool,
    collider_sets: usize,
    /// What a frame that is one launch is submitted with.
    chain: Chain,
}

/// A frame from its start.
struct OpenFrame<T> {
    present: u32,
    substeps: Vec<QueuedSubstep<T>>,
}

/// A substep that is to be done.
#[derive(Clone, Copy)]
struct QueuedSubstep<T> {
    data: SubstepData<T>,
    /// What comes before it.
    kick: Option<Kick<T>>,
}

impl<T> Default for FrameQueue<T> {
    fn default() -> Self {
        Self {
            pending: Vec::new(),
            kick: None,
            open: None,
            saved: None,
            keeps_first: false,
            collider_sets: 1,
            chain: Chain::default(),
        }
    }
}

impl<T> FrameQueue<T> {
    /// Where the colliders at the end of a substep begin.
    pub(super) fn collider_first(&self, index: usize, count: usize) -> u32 {
        (index.min(self.collider_sets.saturating_sub(1)) * count) as u32
    }
}

/// What stands for a body in contact of triangles where kernels read colliders: a plane far below everything.
fn body<T: Real>() -> ColliderData<T> {
    let mut data = ColliderData {
        translation: [T::ZERO, T::ZERO, T::from_f64(FAR_BELOW)],
        ..ColliderData::default()
    };
    for axis in 0..3 {
        data.rotation[4 * axis] = T::ONE;
    }
    data
}

/// A collider as kernels read it; `grid` is the address of its distance grid.
fn collider<T: Real>(
    collider: &cloth_core::Collider,
    grid: u64,
    state: &ColliderState,
) -> ColliderData<T> {
    let [a, b, c] = state.rotation.map(|row| row.map(T::from_f64));
    let (shape, size) = match &collider.shape {
        ColliderShape::Plane => (0, [0.0; 3]),
        &ColliderShape::Sphere { radius } => (1, [radius, 0.0, 0.0]),
        &ColliderShape::Capsule { half_length, radius } => (2, [half_length, radius, 0.0]),
        &ColliderShape::Box { half_extents } => (3, half_extents),
        // It is for contact of triangles alone, where it is a body.
        ColliderShape::Surface(_) => (0, [0.0; 3]),
        ColliderShape::Grid(_) => (4, [f64::from(state.sets.index), state.sets.share, 0.0]),
    };
    ColliderData {
        shape,
        grid,
        translation: state.translation.map(T::from_f64),
        linear_velocity: state.linear_velocity.map(T::from_f64),
        angular_velocity: state.angular_velocity.map(T::from_f64),
        rotation: [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]],
        size: size.map(T::from_f64),
        friction: T::from_f64(collider.friction),
        restitution: T::from_f64(collider.restitution),
        padding: T::ZERO,
    }
}

impl<T: CudaReal> CudaKernels<T> {
    pub(super) fn colliders_upload(&mut self, plan: &FramePlan) -> Result<()> {
        if plan.collider_count == 0 {
            return Ok(());
        }
        let colliders: Vec<ColliderData<T>> = self
            .model
            .colliders()
            .iter()
            .cycle()
            .zip(self.memory.tables.grids.iter().cycle())
            .zip(&plan.colliders)
            .enumerate()
            .map(|(at, ((shape, &grid), state))| {
                match self.model.is_contact_body(at % plan.collider_count) {
                    true => body(),
                    false => collider(shape, grid, state),
                }
            })
            .collect();
        self.frames.collider_sets = plan.colliders.len() / plan.collider_count;
        let Memory { queue, data, inputs, .. } = &mut self.memory;
        inputs.colliders_write(queue, &colliders, data)
    }

    /// Collects a substep.
    pub(super) fn frame_push(&mut self, substep: &Substep) -> Result<()> {
        self.tick += 1;
        let data = self.substep_data(substep, self.tick);
        let kick = self.frames.kick.take();
        self.frames.pending.push(QueuedSubstep { data, kick });
        if self.frames.pending.len() == BATCH_MAX { self.frame_start() } else { Ok(()) }
    }

    /// Hands over what is collected.
    pub(crate) fn frame_start(&mut self) -> Result<()> {
        if self.frames.pending.is_empty() {
            return Ok(());
        }
        let substeps = std::mem::take(&mut self.frames.pending);
        if self.memory.contact.is_some() {
            match &mut self.frames.open {
                Some(open) => open.substeps.extend(&substeps),
                None => {
                    self.saved_prepare()?;
                    self.frames.keeps_first =
                        self.frame.form.keeps_first() && substeps[0].kick.is_none();
                    if !self.frames.keeps_first {
                        self.state_save()?;
                    }
                    let present = self.memory.data.present;
                    let substeps = substeps.clone();
                    self.frames.open = Some(OpenFrame { present, substeps });
                }
            }
        }
        self.substeps_run(&substeps)
    }

    /// Hands over what is collected and waits until it is known to be good.
    pub(crate) fn settle(&mut self) -> Result<()> {
        self.frame_start()?;
        while let Some(mut open) = self.frames.open.take() {
            let status = self.memory.status.read(&self.memory.queue)?;
            self.status_book(&status);
            if !status.overflowed() {
                break;
            }
            self.contacts_grow(&status)?;
            self.state_saved_restore(open.present)?;
            for substep in &mut open.substeps {
                self.tick += 1;
                substep.data.tick = self.tick;
            }
            let substeps = open.substeps.clone();
            self.frames.open = Some(open);
            self.substeps_run(&substeps)?;
        }
        match self.frames.kick.take() {
            Some(kick) => self.kick_run(&kick),
            None => Ok(()),
        }
    }

    fn saved_prepare(&mut self) -> Result<()> {
        if self.frames.saved.is_none() {
            let (queue, n) = (&self.memory.queue, self.model.particle_count());
            self.frames.saved = Some([Buffer::zeros(queue, n)?, Buffer::zeros(queue, n)?]);
        }
        Ok(())
    }

    /// Keeps the state at the start of a frame.
    fn state_save(&mut self) -> Result<()> {
        let (queue, present) = (&self.memory.queue, self.memory.present());
        if let Some(saved) = &mut self.frames.saved {
            self.memory.state.save(queue, present, saved)?;
        }
        if let Some(memory) = &mut self.memory.feedback {
            memory.of_frame.copy_from(queue, &memory.impulses)?;
        }
        Ok(())
    }

    fn state_saved_restore(&mut self, present: u32) -> Result<()> {
        self.memory.data.present = present;
        if let Some(saved) = &self.frames.saved {
            self.memory.state.saved_restore(&self.memory.queue, present as usize, saved)?;
        }
        if let Some(memory) = &mut self.memory.feedback {
            memory.impulses.copy_from(&self.memory.queue, &memory.of_frame)?;
        }
        Ok(())
    }

    /// All substeps, in one launch if nothing comes between them.
    fn substeps_run(&mut self, substeps: &[QueuedSubstep<T>]) -> Result<()> {
        let data: Vec<SubstepData<T>> = substeps.iter().map(|substep| substep.data).collect();
        self.substeps_write(&data)?;
        let most = self.frame.substeps_max;
        // Each run begins with a kick, or with the first substep.
        let mut next = self.memory.data.substeps;
        let runs = substeps.chunk_by(|_, next| next.kick.is_none());
        for run in runs.flat_map(|run| run.chunks(most)) {
            self.memory.data.substeps = next;
            next += (run.len() * size_of::<SubstepData<T>>()) as u64;
            if let Some(kick) = &run[0].kick {
                self.kick_run(kick)?;
            }
            self.frame_run(run.len() as u32)?;
        }
        Ok(())
    }

    /// The substeps that come next on the device, in one launch.
    fn frame_run(&mut self, count: u32) -> Result<()> {
        self.frame_counts_begin()?;
        let first = self.memory.present();
        let keeps = std::mem::take(&mut self.frames.keeps_first);
        if let (true, Some([position, velocity])) = (keeps, &self.frames.saved) {
            self.memory.data.position[2] = position.address();
            self.memory.data.velocity[2] = velocity.address();
        }
        if self.frame.form == FrameForm::Stages && self.model.has_passable_colliders() {
            let Memory { queue, data, state, .. } = &mut self.memory;
            state.start_prepare(queue, data)?;
        }
        self.frame_submit(count)?;
        self.memory.data.start_position = 0;
        self.memory.data.epoch += u64::from(count);
        self.memory.data.present ^= (count * self.frame.motions) & 1;
        if let (true, Some(saved)) = (keeps, &mut self.frames.saved) {
            self.memory.state.exchange(first, saved, &mut self.memory.data);
        }
        Ok(())
    }

    /// Submits the kernel of so many substeps and the events around it.
    fn frame_submit(&mut self, count: u32) -> Result<()> {
        let (module, launch) = (self.frame.form.module(), self.frame.launch);
        let kernel = self.cache.kernel(module, "explicit_frame")?;
        let span = self.timing.span(&self.memory.queue, "explicit_substep")?;
        let data = self.memory.data;
        let mut arguments = [argument(&data), argument(&count)];
        let mut links = Vec::with_capacity(3);
        links.extend(span.map(|[start, _]| Link::Event(start)));
        links.push(Link::Kernel { kernel, launch, arguments: &mut arguments });
        links.extend(span.map(|[_, end]| Link::Event(end)));
        // SAFETY: these are the arguments that a kernel of this name takes; all memory is owned by this solver, which waits for
        // its queue before any of it is freed, as are events.
        unsafe { self.frames.chain.submit(&self.memory.queue, &mut links) }
    }

    /// Notes where particles are, for colliders.
    pub(super) fn start_copy(&mut self) -> Result<()> {
        let Memory { queue, data, state, .. } = &mut self.memory;
        state.start_copy(queue, data)
    }

    /// Shortens the springs of a colour, or the triangles.
    pub(super) fn colour_limit(
        &mut self,
        name: &'static str,
        length: f64,
        colour: usize,
    ) -> Result<()> {
        let colours = &self.memory.tables.colours[usize::from(name == "stretch_limit")];
        let [first, end] = [colours[colour], colours[colour + 1]];
        let (count, length, step) = (end - first, T::from_f64(length), 0_u64);
        let arguments = [argument(&first), argument(&count), argument(&length), argument(&step)];
        self.start((name, name), Launch::over(count as usize), &arguments)
    }

    /// All sweeps over springs and triangles, in one launch.
    pub(super) fn sweeps_limit(&mut self, length: f64) -> Result<()> {
        let kernel = self.cache.kernel("stretch_limit", "strain_limit_sweeps")?;
        let resident = self.memory.queue.device.resident_blocks(kernel, SWEEP_THREADS, 0)?;
        let longest = |rows: &Vec<u32>| rows.windows(2).map(|row| row[1] - row[0]).max();
        let most = self.memory.tables.colours.iter().filter_map(longest).max().unwrap_or(0);
        let blocks = resident.min(most.div_ceil(SWEEP_THREADS)).max(1);
        let launch = Launch { blocks, threads: SWEEP_THREADS, shared: 0, cooperative: true };
        let (length, step) = (T::from_f64(length), 0_u64);
        self.start(
            ("stretch_limit", "strain_limit_sweeps"),
            launch,
            &[argument(&length), argument(&step)],
        )
    }
}
