//! What [`DeviceContact`](cloth_core::contact::device::DeviceContact) asks of the device.

use std::ffi::c_void;

use cloth_core::{
    Error, NewtonStart, Result,
    contact::{
        ContactEquation, ContactSet,
        device::{
            GROUP, MotionVector, PAIR_WORDS, PairAnswer, PairDevice, PairLook, PairTask, WaysFrom,
        },
    },
};

use super::CudaKernels;
use crate::{
    fault::BACKEND,
    layout::{CudaReal, Real4},
    queue::{Launch, argument},
    triangle_contact::TriangleMemory,
};

/// Threads of a block that finds how far particles have moved, as in `contact_pairs.cu`.
const MOVED_THREADS: u32 = 128;
/// Threads of a block that lists pairs.
const LIST_THREADS: u32 = 128;
/// Threads of a block that makes the tree, and blocks at most.
const TREE_THREADS: u32 = 256;
const TREE_BLOCKS: u32 = 256;

/// The device while contact of triangles works on it.
pub(super) struct Working<'a, T> {
    pub(super) kernels: &'a mut CudaKernels<T>,
    pub(super) memory: &'a mut TriangleMemory<T>,
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
        let word = size_of::<u32>();
        self.memory.results.clear_bytes(&self.kernels.memory.queue, word * which, word)
    }

    /// Puts the ways in place.
    fn ways_put(&mut self, from: WaysFrom, task: &PairTask<T>) -> Result<()> {
        let launch = Launch::over(self.kernels.count());
        match from {
            WaysFrom::Device => Ok(()),
            WaysFrom::Velocities => self.pairs_start("contact_pairs_ahead", launch, task),
            WaysFrom::Substep | WaysFrom::Iterate => {
                let state = &self.kernels.memory.state;
                let start = match from {
                    WaysFrom::Iterate => &state.proven,
                    _ => &state.start,
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
        self.memory.results_create(&self.kernels.memory.queue, task)
    }

    fn ways_write(&mut self, first: usize, ways: &[[T; 4]]) -> Result<()> {
        self.memory.ways.write(&self.kernels.memory.queue, first, ways)
    }

    fn nodes_write(&mut self, start: &[Real4<T>], end: Option<&[Real4<T>]>) -> Result<()> {
        let (queue, particles) = (&self.kernels.memory.queue, self.kernels.count());
        self.memory.ways.write(queue, particles, start)?;
        let behind = 2 * particles + start.len();
        end.map_or(Ok(()), |end| self.memory.ways.write(queue, behind, end))
    }

    fn look(
        &mut self,
        task: &PairTask<T>,
        ways: WaysFrom,
        look: PairLook,
        expected: usize,
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
        let capacity = task.found_capacity as usize;
        let words = |count| TriangleMemory::result_head(task) + PAIR_WORDS * count;
        let read = &mut out.words;
        self.memory.results.read_first(queue, words(expected.min(capacity)), read)?;
        let count = (read[0] as usize).min(capacity);
        if read.len() < words(count) {
            self.memory.results.read_first(queue, words(count), read)?;
        }
        TriangleMemory::answer(task, out);
        Ok(())
    }

    fn references_take(&mut self, _: &PairTask<T>) -> Result<()> {
        let TriangleMemory { ways, references, .. } = &mut *self.memory;
        references.copy_from(&self.kernels.memory.queue, ways)
    }

    fn boxes_fit(&mut self, task: &PairTask<T>) -> Result<()> {
        let groups = Launch::over(task.group_count as usize);
        self.pairs_start("contact_pairs_boxes", groups, task)?;
        let blocks = TREE_BLOCKS.min(task.group_count / 2);
        let tree = |blocks| Launch { blocks, threads: TREE_THREADS, shared: 0, cooperative: false };
        if blocks > 0 {
            self.pairs_start("contact_pairs_tree", tree(blocks), task)?;
        }
        if blocks > 1 {
            self.pairs_start("contact_pairs_tree_top", tree(1), task)?;
        }
        Ok(())
    }

    fn list_fill(&mut self, task: &PairTask<T>) -> Result<u32> {
        self.count_clear(1)?;
        let blocks = ((GROUP * GROUP) as u32 * task.listing_groups()).div_ceil(LIST_THREADS);
        let launch = Launch { blocks, threads: LIST_THREADS, shared: 0, cooperative: false };
        self.pairs_start("contact_pairs_list", launch, task)?;
        let mut counts = Vec::new();
        self.memory.results.read_first(&self.kernels.memory.queue, 2, &mut counts)?;
        Ok(counts[1])
    }

    fn motion_read(&mut self, wanted: &mut [(MotionVector, &mut Vec<[T; 4]>)]) -> Result<()> {
        let memory = &self.kernels.memory;
        let (state, present) = (&memory.state, memory.present());
        for (which, out) in wanted {
            let from = match which {
                MotionVector::Position => Some(&state.position[present]),
                MotionVector::Velocity => Some(&state.velocity[present]),
                MotionVector::Start => state.start.as_ref(),
                MotionVector::Iterate => state.proven.as_ref(),
            };
            from.map_or(Ok(()), |from| from.read(&memory.queue, out))?;
        }
        Ok(())
    }

    fn motion_write(&mut self, position: &[Real4<T>], velocity: &[Real4<T>]) -> Result<()> {
        let memory = &mut self.kernels.memory;
        let present = memory.present();
        memory.state.write(&memory.queue, present, position, velocity)
    }

    fn contacts_write(
        &mut self,
        set: &ContactSet<T>,
        equation: impl Fn(usize) -> ContactEquation<T> + Sync,
        _: NewtonStart,
    ) -> Result<()> {
        let place = (&self.kernels.memory.queue, self.kernels.count());
        self.memory.contacts_write(place, set, equation)
    }
}
