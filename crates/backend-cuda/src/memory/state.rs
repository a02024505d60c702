//! Motion of all particles, and its copies.

use cloth_core::Result;

use crate::{
    layout::{CudaReal, Real4, SolverData},
    queue::{Buffer, Queue},
};

/// Positions or velocities of all particles.
type Field<T> = Buffer<Real4<T>>;

/// Device memory of the motion. `present` is the index of the motion that holds at present; the other one holds nothing.
pub(crate) struct StateMemory<T> {
    pub(crate) position: [Field<T>; 2],
    pub(crate) velocity: [Field<T>; 2],
    pub(crate) force: Field<T>,
    /// Positions and velocities of the last `state_keep`.
    kept: Option<[Field<T>; 2]>,
    /// Velocities of an iterate of Newton's method.
    iterate: Option<Field<T>>,
    /// Positions of the last `iterate_keep`.
    pub(crate) proven: Option<Field<T>>,
    /// Positions of the last `start_keep`.
    pub(crate) start: Option<Field<T>>,
}

impl<T: CudaReal> StateMemory<T> {
    /// Memory for so many particles, without the copies.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue, count: usize) -> Result<Self> {
        Ok(Self {
            position: [Buffer::zeros(queue, count)?, Buffer::zeros(queue, count)?],
            velocity: [Buffer::zeros(queue, count)?, Buffer::zeros(queue, count)?],
            force: Buffer::zeros(queue, count)?,
            kept: None,
            iterate: None,
            proven: None,
            start: None,
        })
    }

    /// Tells kernels where it is.
    pub(crate) fn describe(&self, data: &mut SolverData<T>) {
        let [a, b] = self.position.each_ref().map(Buffer::address);
        data.position = [a, b, 0];
        let [a, b] = self.velocity.each_ref().map(Buffer::address);
        data.velocity = [a, b, 0];
        data.force = self.force.address();
    }

    /// After a launch that left motion `first` as it is: that is the saved one now, and what was saved has the state that stood in
    /// for it.
    pub(crate) fn exchange(
        &mut self,
        first: usize,
        saved: &mut [Field<T>; 2],
        data: &mut SolverData<T>,
    ) {
        let [position, velocity] = saved;
        std::mem::swap(&mut self.position[first], position);
        std::mem::swap(&mut self.velocity[first], velocity);
        self.describe(data);
    }

    /// Copies the motion to `saved`.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn save(
        &self,
        queue: &Queue,
        present: usize,
        saved: &mut [Field<T>; 2],
    ) -> Result<()> {
        let [position, velocity] = saved;
        position.copy_from(queue, &self.position[present])?;
        velocity.copy_from(queue, &self.velocity[present])
    }

    /// Copies the motion from `saved`.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn saved_restore(
        &mut self,
        queue: &Queue,
        present: usize,
        [position, velocity]: &[Field<T>; 2],
    ) -> Result<()> {
        self.position[present].copy_from(queue, position)?;
        self.velocity[present].copy_from(queue, velocity)
    }

    /// Puts a motion from the host in place.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn write(
        &mut self,
        queue: &Queue,
        present: usize,
        position: &[Real4<T>],
        velocity: &[Real4<T>],
    ) -> Result<()> {
        self.position[present].write(queue, 0, position)?;
        self.velocity[present].write(queue, 0, velocity)
    }

    /// Whether there was a `state_keep`, or room was made for it.
    pub(crate) const fn has_kept(&self) -> bool {
        self.kept.is_some()
    }

    /// Makes room for `state_keep`.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn kept_prepare(&mut self, queue: &Queue, data: &mut SolverData<T>) -> Result<()> {
        if self.kept.is_none() {
            let kept = [self.another(queue)?, self.another(queue)?];
            data.kept_position = kept[0].address();
            data.kept_velocity = kept[1].address();
            self.kept = Some(kept);
        }
        Ok(())
    }

    /// `state_keep`.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn keep(&mut self, queue: &Queue, data: &mut SolverData<T>) -> Result<()> {
        self.kept_prepare(queue, data)?;
        let present = data.present as usize;
        if let Some([position, velocity]) = &mut self.kept {
            position.copy_from(queue, &self.position[present])?;
            velocity.copy_from(queue, &self.velocity[present])?;
        }
        Ok(())
    }

    /// `velocity_keep`.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn velocity_keep(&mut self, queue: &Queue, present: usize) -> Result<()> {
        if self.iterate.is_none() {
            self.iterate = Some(self.another(queue)?);
        }
        match &mut self.iterate {
            Some(kept) => kept.copy_from(queue, &self.velocity[present]),
            None => Ok(()),
        }
    }

    /// `velocity_restore`.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn velocity_restore(&mut self, queue: &Queue, present: usize) -> Result<()> {
        match &self.iterate {
            Some(kept) => self.velocity[present].copy_from(queue, kept),
            None => Ok(()),
        }
    }

    /// `iterate_keep`.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn proven_keep(&mut self, queue: &Queue, present: usize) -> Result<()> {
        let proven = match self.proven.take() {
            Some(proven) => proven,
            None => self.another(queue)?,
        };
        self.proven.insert(proven).copy_from(queue, &self.position[present])
    }

    /// Makes room for where particles are at the start of a substep, for colliders.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn start_prepare(&mut self, queue: &Queue, data: &mut SolverData<T>) -> Result<()> {
        let start = match self.start.take() {
            Some(start) => start,
            None => self.another(queue)?,
        };
        data.start_position = start.address();
        self.start = Some(start);
        Ok(())
    }

    /// Notes where particles are, for colliders.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn start_copy(&mut self, queue: &Queue, data: &mut SolverData<T>) -> Result<()> {
        self.start_prepare(queue, data)?;
        let from = &self.position[data.present as usize];
        self.start.as_mut().map_or(Ok(()), |start| start.copy_from(queue, from))
    }

    /// Room for one more copy.
    fn another(&self, queue: &Queue) -> Result<Field<T>> {
        Buffer::zeros(queue, self.force.len())
    }
}
