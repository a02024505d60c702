//! All memory of one solver on the device: its motion, the tables of the model, what a frame is given, and what is found.

mod contact;
mod feedback;
mod inputs;
mod state;
mod status;
mod tables;

use std::sync::Arc;

use cloth_core::{Model, Result, SolverConfig};

use crate::{
    device::Device,
    layout::{BLOCK, CudaReal, SolverData},
    measure::FIGURES,
    patch::Patch,
    queue::{Buffer, Queue},
    tables::{SpringTables, StrainTables},
};

use contact::ContactMemory;
pub(crate) use feedback::FeedbackMemory;
use inputs::InputMemory;
use state::StateMemory;
use status::StatusMemory;
use tables::TableMemory;

/// Device memory of a solver.
pub(crate) struct Memory<T> {
    pub(crate) queue: Queue,
    /// Where all of it is: the first argument of every kernel.
    pub(crate) data: SolverData<T>,
    pub(crate) state: StateMemory<T>,
    pub(crate) tables: TableMemory<T>,
    pub(crate) inputs: InputMemory<T>,
    pub(crate) status: StatusMemory,
    /// Sums over blocks of particles.
    pub(crate) partials: Buffer<f64>,
    pub(crate) feedback: Option<FeedbackMemory>,
    pub(crate) contact: Option<ContactMemory<T>>,
}

impl<T: CudaReal> Memory<T> {
    /// Memory for a model, but for that of contact. Without `patches` no regular patch is looked for.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(
        device: Arc<Device>,
        model: &Model,
        strain: &StrainTables<T>,
        patches: bool,
    ) -> Result<Self> {
        let queue = Queue::new(device)?;
        let n = model.particle_count();
        let springs = SpringTables::<T>::new(model, patches);
        let state = StateMemory::new(&queue, n)?;
        let status = StatusMemory::new(&queue)?;
        let partials = Buffer::zeros(&queue, n.div_ceil(BLOCK) * FIGURES)?;
        let mut data: SolverData<T> = {
            // SAFETY: it is made of integers and floating point numbers alone, for which zero is a value.
            unsafe { std::mem::zeroed() }
        };
        state.describe(&mut data);
        data.status = status.address();
        data.partials = partials.address();
        data.count = n as u32;
        data.collider_count = model.colliders().len() as u32;
        data.has_air = u32::from(model.air().is_some());
        data.acceleration = model.uniform_acceleration().map(T::from_f64);
        data.drag_rate = model.drag_rate().map(T::from_f64);
        let mut tables = TableMemory::new(&queue, model, springs, strain, &mut data)?;
        let feedback = if model.collider_impulses() && !model.colliders().is_empty() {
            let memory = FeedbackMemory::new(&queue, n, model.colliders().len())?;
            data.collider_impulses = memory.impulses.address();
            Some(memory)
        } else {
            None
        };
        let inputs = InputMemory::new(&queue)?;
        if model.air().is_some() {
            tables.triangles_prepare(&queue, model, &mut data)?;
        }
        Ok(Self { queue, data, state, tables, inputs, status, partials, feedback, contact: None })
    }

    /// Takes the memory for contact of points, if there is any; a patch has its tiles divided into groups.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn contact_prepare(
        &mut self,
        model: &Model,
        config: &SolverConfig,
        patch: Option<Patch>,
    ) -> Result<()> {
        let points = model.self_contact().filter(|contact| !contact.is_of_triangles());
        if let Some(contact) = points {
            let memory = ContactMemory::new(&self.queue, model, contact, patch)?;
            memory.describe(&mut self.data, contact.distance, config.time_step);
            self.contact = Some(memory);
        }
        Ok(())
    }

    /// Makes the other motion the present one.
    pub(crate) fn swap(&mut self) {
        self.data.present = 1 - self.data.present;
    }

    /// Index of the present motion.
    pub(crate) const fn present(&self) -> usize {
        self.data.present as usize
    }
}
