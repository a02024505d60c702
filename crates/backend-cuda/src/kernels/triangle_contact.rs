//! Contact of triangles: what [`DeviceContact`] asks of the device.

use std::{ffi::c_void, sync::Arc};

use cloth_core::{
    ColliderImpulse, Error, Model, NewtonStart, Result, State,
    contact::{
        Candidate, ContactEquation, ContactLaw, ContactSet, Contacts, Ghost,
        device::{
            DeviceContact, GROUP, PAIR_WORDS, PairAnswer, PairDevice, PairLook, PairTask, WaysFrom,
            pairs_of,
        },
    },
    schwarz::ContactRows,
    stepper::{FramePlan, Substep},
};

use super::CudaKernels;
use crate::{
    fault::BACKEND,
    layout::{CudaReal, Real4},
    queue::{Buffer, Launch, argument},
    triangle_contact::TriangleMemory,
};

/// Threads of a block that finds how far particles have moved, as in `contact_pairs.cu`.
const MOVED_THREADS: u32 = 128;
/// Threads of the block that makes the tree.
const TREE_THREADS: u32 = 1024;

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

/// The device while contact of triangles works on it.
struct Working<'a, T> {
    kernels: &'a mut CudaKernels<T>,
    memory: &'a mut TriangleMemory<T>,
}

impl<T: CudaReal> CudaKernels<T> {
    /// Takes the memory for contact of triangles, if there is any.
    pub(super) fn triangles_prepare(&mut self) -> Result<()> {
        let pinch = self.config.pinch;
        let Some(contact) = DeviceContact::new(&self.model, pinch) else { return Ok(()) };
        let memory = TriangleMemory::new(&self.memory.queue, &contact, self.count())?;
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
        Ok(())
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
        let (present, memory) = (self.memory.present(), &mut self.memory);
        let proven = match memory.proven.take() {
            Some(proven) => proven,
            None => Buffer::zeros(&memory.queue, self.model.particle_count())?,
        };
        memory.proven.insert(proven).copy_from(&memory.queue, &memory.position[present])
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
        if self.memory.start.is_none() { self.start_copy() } else { Ok(()) }
    }
}

impl<T: CudaReal> Working<'_, T> {
    /// Starts a kernel of contact of triangles.
    fn start(
        &mut self,
        stage: &'static str,
        name: (&'static str, &'static str),
        launch: Launch,
        task: &PairTask<T>,
    ) -> Result<()> {
        let data = self.memory.data(*task);
        let arguments: [*mut c_void; 1] = [argument(&data)];
        self.kernels.stage(stage, |kernels| kernels.start(name, launch, &arguments))
    }

    fn pairs_start(
        &mut self,
        kernel: &'static str,
        launch: Launch,
        task: &PairTask<T>,
    ) -> Result<()> {
        self.start("contact_pairs", ("contact_pairs", kernel), launch, task)
    }

    fn count_clear(&mut self, which: usize) -> Result<()> {
        self.memory.counts.write(&self.kernels.memory.queue, which, &[0])
    }

    fn counts(&self) -> Result<[u32; 2]> {
        let mut counts = Vec::new();
        self.memory.counts.read(&self.kernels.memory.queue, &mut counts)?;
        Ok([counts[0], counts[1]])
    }

    /// Puts the ways in place.
    fn ways_put(&mut self, from: WaysFrom, task: &PairTask<T>) -> Result<()> {
        let launch = Launch::over(self.kernels.count());
        match from {
            WaysFrom::Device => Ok(()),
            WaysFrom::Velocities => self.pairs_start("contact_pairs_ahead", launch, task),
            WaysFrom::Substep | WaysFrom::Iterate => {
                let memory = &self.kernels.memory;
                let start = match from {
                    WaysFrom::Iterate => &memory.proven,
                    _ => &memory.start,
                };
                let Some(start) = start else {
                    let feature = "contact_certify without the start of the substep".into();
                    return Err(Error::Unsupported { backend: BACKEND, feature });
                };
                // Whoever looks at colliders may have taken it away.
                let before = self.kernels.memory.data.start_position;
                self.kernels.memory.data.start_position = start.address();
                let done = self.pairs_start("contact_pairs_substep", launch, task);
                self.kernels.memory.data.start_position = before;
                done
            }
        }
    }
}

impl<T: CudaReal> PairDevice<T> for Working<'_, T> {
    fn list_create(&mut self, task: &PairTask<T>) -> Result<()> {
        self.memory.list_create(&self.kernels.memory.queue, task.pair_capacity)
    }

    fn results_create(&mut self, task: &PairTask<T>) -> Result<()> {
        self.memory.found_create(&self.kernels.memory.queue, task.found_capacity)
    }

    fn ways_write(&mut self, first: usize, ways: &[[T; 4]]) -> Result<()> {
        self.memory.ways.write(&self.kernels.memory.queue, first, ways)
    }

    fn nodes_write(&mut self, start: &[Real4<T>], end: &[Real4<T>]) -> Result<()> {
        let (queue, particles) = (&self.kernels.memory.queue, self.kernels.count());
        self.memory.ways.write(queue, particles, start)?;
        self.memory.ways.write(queue, 2 * particles + start.len(), end)
    }

    fn look(
        &mut self,
        task: &PairTask<T>,
        ways: WaysFrom,
        look: PairLook,
        _: usize,
        out: &mut PairAnswer<T>,
    ) -> Result<()> {
        self.count_clear(0)?;
        self.ways_put(ways, task)?;
        let blocks = 2 * task.moved_blocks;
        let moved = Launch { blocks, threads: MOVED_THREADS, shared: 0, cooperative: false };
        self.pairs_start("contact_pairs_moved", moved, task)?;
        let kernel = match look {
            PairLook::Moved => None,
            PairLook::Near => Some("contact_geometry"),
            PairLook::Unproven => Some("contact_certify"),
        };
        if let Some(kernel) = kernel {
            let launch = Launch::over(task.pair_count as usize);
            self.start(kernel, (kernel, kernel), launch, task)?;
        }
        let queue = &self.kernels.memory.queue;
        self.memory.moved.read(queue, &mut out.moved)?;
        out.found = self.counts()?[0];
        let count = out.found.min(task.found_capacity) as usize;
        let mut pairs = Vec::new();
        self.memory.found.read_first(queue, count, &mut pairs)?;
        out.pairs.clear();
        out.pairs.extend_from_slice(pairs.as_flattened());
        debug_assert_eq!(out.pairs.len(), PAIR_WORDS * count);
        Ok(())
    }

    fn references_take(&mut self, _: &PairTask<T>) -> Result<()> {
        let TriangleMemory { ways, references, .. } = &mut *self.memory;
        references.copy_from(&self.kernels.memory.queue, ways)
    }

    fn references_drift(&mut self, task: &PairTask<T>) -> Result<()> {
        let launch = Launch::over(task.node_count as usize);
        self.pairs_start("contact_pairs_reference", launch, task)
    }

    fn boxes_fit(&mut self, task: &PairTask<T>) -> Result<()> {
        let groups = Launch::over(task.group_count as usize);
        self.pairs_start("contact_pairs_boxes", groups, task)?;
        let tree = Launch { blocks: 1, threads: TREE_THREADS, shared: 0, cooperative: false };
        self.pairs_start("contact_pairs_tree", tree, task)
    }

    fn list_fill(&mut self, task: &PairTask<T>) -> Result<u32> {
        self.count_clear(1)?;
        let launch = Launch::over(GROUP * GROUP * task.own_group_count as usize);
        self.pairs_start("contact_pairs_list", launch, task)?;
        Ok(self.counts()?[1])
    }

    fn ends_read(&mut self, position: &mut Vec<[T; 4]>, start: &mut Vec<[T; 4]>) -> Result<()> {
        let memory = &self.kernels.memory;
        memory.position[memory.present()].read(&memory.queue, position)?;
        memory.start.as_ref().map_or(Ok(()), |from| from.read(&memory.queue, start))
    }

    fn iterate_read(&mut self, iterate: &mut Vec<[T; 4]>) -> Result<()> {
        let memory = &self.kernels.memory;
        memory.proven.as_ref().map_or(Ok(()), |from| from.read(&memory.queue, iterate))
    }

    fn velocities_read(&mut self, velocity: &mut Vec<[T; 4]>) -> Result<()> {
        let memory = &self.kernels.memory;
        memory.velocity[memory.present()].read(&memory.queue, velocity)
    }

    fn motion_write(&mut self, position: &[Real4<T>], velocity: &[Real4<T>]) -> Result<()> {
        let memory = &mut self.kernels.memory;
        let present = memory.present();
        memory.position[present].write(&memory.queue, 0, position)?;
        memory.velocity[present].write(&memory.queue, 0, velocity)
    }

    fn contacts_write(
        &mut self,
        set: &ContactSet<T>,
        equations: &[ContactEquation<T>],
        _: NewtonStart,
    ) -> Result<()> {
        self.memory.contacts_write(&self.kernels.memory.queue, set, equations)
    }
}
