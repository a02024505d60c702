//! What the host gives for a frame.

use cloth_core::Result;

use crate::{
    layout::{ColliderData, ControlForceData, CudaReal, PinData, SolverData, SubstepData},
    queue::{Buffer, Queue},
};

/// Device memory of the inputs, which grow as they need to.
pub(crate) struct InputMemory<T> {
    colliders: Buffer<ColliderData<T>>,
    substeps: Buffer<SubstepData<T>>,
    pub(crate) pins: Buffer<PinData<T>>,
    pub(crate) control_forces: Buffer<ControlForceData<T>>,
}

impl<T: CudaReal> InputMemory<T> {
    /// Room for one of each.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue) -> Result<Self> {
        Ok(Self {
            colliders: Buffer::zeros(queue, 1)?,
            substeps: Buffer::zeros(queue, 1)?,
            pins: Buffer::zeros(queue, 1)?,
            control_forces: Buffer::zeros(queue, 1)?,
        })
    }

    /// Puts colliders in place of those before.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn colliders_write(
        &mut self,
        queue: &Queue,
        colliders: &[ColliderData<T>],
        data: &mut SolverData<T>,
    ) -> Result<()> {
        self.colliders.write_growing(queue, colliders)?;
        data.colliders = self.colliders.address();
        Ok(())
    }

    /// Puts substeps in place of those before.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn substeps_write(
        &mut self,
        queue: &Queue,
        substeps: &[SubstepData<T>],
        data: &mut SolverData<T>,
    ) -> Result<()> {
        self.substeps.write_growing(queue, substeps)?;
        data.substeps = self.substeps.address();
        Ok(())
    }
}
