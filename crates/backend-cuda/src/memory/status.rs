//! What the device tells the host.

use cloth_core::Result;

use crate::{
    layout::Status,
    queue::{Buffer, Queue},
};

/// Device memory of the status.
pub(crate) struct StatusMemory {
    buffer: Buffer<Status>,
    /// Blocks that have last met in a linear solver.
    solver_blocks: u32,
}

impl StatusMemory {
    /// Memory that [`Self::reset`] has yet to fill.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue) -> Result<Self> {
        Ok(Self { buffer: Buffer::zeros(queue, 1)?, solver_blocks: 0 })
    }

    pub(crate) const fn address(&self) -> u64 {
        self.buffer.address()
    }

    /// Forgets what went wrong, and the candidate list.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn reset(&mut self, queue: &Queue) -> Result<()> {
        let status = Status {
            non_finite_step: u64::MAX,
            barrier: [0; 2],
            meetings: [0; 2],
            contacts: 0,
            candidates: 0,
            overflow: 0,
            group_overflow: 0,
            rebuilds: 0,
            built: 0,
            stale: [0; 4],
            large: 0,
            searched: [0; 3],
            taken: [0; 3],
            again: 0,
        };
        self.buffer.write(queue, 0, &[status])
    }

    /// Waits for all work and reads it.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn read(&self, queue: &Queue) -> Result<Status> {
        let mut status = Vec::new();
        self.buffer.read(queue, &mut status)?;
        Ok(status[0])
    }

    /// Sets the counter of the meetings of a linear solver back where another number of blocks comes to them: it has to begin with a
    /// multiple of that.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn solver_barrier_prepare(&mut self, queue: &Queue, blocks: u32) -> Result<()> {
        if self.solver_blocks == blocks {
            return Ok(());
        }
        self.solver_blocks = blocks;
        let second = std::mem::offset_of!(Status, barrier) + size_of::<u64>();
        self.buffer.clear_bytes(queue, second, size_of::<u64>())
    }
}
