//! The stages of the linear system.

mod constraints;
mod memory;
mod read;
mod schwarz;
mod solve;

use cloth_core::{LinearVector, MatrixForm, NewtonStart, Preconditioner, Result, stepper::Substep};

pub(super) use schwarz::SchwarzTables;

use super::Stages;
use crate::{
    dispatch::WORKGROUP,
    layout::{CALL_BLOCKS, CALL_ITERATE, Call},
    linear::{matrix_check, preconditioner_check, vector_number},
};

/// Different calls that wait for the device at a time.
pub(super) const CALLS_MAX: usize = 256;

impl Stages {
    /// The entry of the parameters for a call. Entries are written once, before the work that reads them
    /// is handed over.
    pub(super) fn call(&mut self, call: Call) -> Result<usize> {
        if let Some(index) = self.calls.iter().position(|known| *known == call) {
            return Ok(index);
        }
        if self.calls.len() == CALLS_MAX {
            self.recorder.submit(&self.context)?;
            self.calls.clear();
        }
        let index = self.calls.len();
        self.calls.push(call);
        let stride = crate::buffers::uniform_stride(&self.context.limits, size_of::<Call>());
        let buffer = self.buffers.get("call", 0, 0)?;
        self.context.queue.write_buffer(buffer, index as u64 * stride, bytemuck::bytes_of(&call));
        Ok(index)
    }

    /// A kernel of the linear system with one thread for each particle.
    pub(super) fn linear_kernel(
        &mut self,
        name: &'static str,
        slot: usize,
        call: Call,
    ) -> Result<()> {
        self.linear_prepare()?;
        let call = self.call(call)?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(name, name, items, self.present, (slot, call))
    }

    pub(super) fn spring_linearise(&mut self, substep: &Substep) -> Result<()> {
        self.semi_implicit.length = None;
        let slot = self.slot(substep)?;
        self.linear_kernel("spring_linearise", slot, Call::default())
    }

    pub(super) fn contact_linearise(&mut self, substep: &Substep) -> Result<()> {
        if !self.is_penalty() {
            return Ok(());
        }
        let slot = self.slot(substep)?;
        self.linear_kernel("contact_linearise", slot, Call::default())
    }

    pub(super) fn implicit_assemble(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if !self.has_force {
            return Ok(());
        }
        self.semi_implicit.length = None;
        let slot = self.slot(substep)?;
        self.linear_prepare()?;
        self.fabric_assemble(slot)?;
        let flags = if start == NewtonStart::Iterate { CALL_ITERATE } else { 0 };
        self.linear_kernel("implicit_assemble", slot, Call { flags, ..Call::default() })
    }

    pub(crate) fn matrix_apply(
        &mut self,
        form: MatrixForm,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        matrix_check(form)?;
        self.linear_kernel("matrix_apply", 0, vectors_call(from, to))
    }

    pub(crate) fn preconditioner_build(&mut self, preconditioner: Preconditioner) -> Result<()> {
        let preconditioner = preconditioner.at_first();
        preconditioner_check(preconditioner)?;
        self.semi_implicit.length = None;
        self.preconditioner = preconditioner;
        let flags = if preconditioner == Preconditioner::Diagonal { 0 } else { CALL_BLOCKS };
        self.linear_kernel("preconditioner_build", 0, Call { flags, ..Call::default() })?;
        match preconditioner {
            Preconditioner::Schwarz => self.schwarz_build(),
            _ => Ok(()),
        }
    }

    pub(crate) fn preconditioner_apply(
        &mut self,
        from: LinearVector,
        to: LinearVector,
    ) -> Result<()> {
        if self.preconditioner == Preconditioner::Schwarz {
            return self.schwarz_record((from, to), 0);
        }
        self.linear_kernel("preconditioner_apply", 0, vectors_call(from, to))
    }

    pub(crate) fn vector_combine(
        &mut self,
        (from_scale, from): (f64, LinearVector),
        (to_scale, to): (f64, LinearVector),
    ) -> Result<()> {
        let [from_scale, to_scale] = [from_scale as f32, to_scale as f32];
        let call = Call { from_scale, to_scale, ..vectors_call(from, to) };
        self.linear_kernel("vector_combine", 0, call)
    }

    pub(crate) fn vector_fill(&mut self, value: [f64; 3], to: LinearVector) -> Result<()> {
        let [value_x, value_y, value_z] = value.map(|number| number as f32);
        let vector_to = vector_number(to);
        let call = Call { vector_to, value_x, value_y, value_z, ..Call::default() };
        self.linear_kernel("vector_fill", 0, call)
    }

    /// Moves or accelerates all particles, by a kernel that is told one number.
    pub(super) fn motion_change(&mut self, name: &'static str, amount: f64) -> Result<()> {
        self.linear_prepare()?;
        let call = self.call(Call { amount: amount as f32, ..Call::default() })?;
        let items = (self.particle_count(), WORKGROUP);
        let next = self.free_motion();
        self.dispatch(name, name, items, next, (self.slots.current, call))?;
        self.has_boxes[next] = false;
        self.present = next;
        Ok(())
    }
}

fn vectors_call(from: LinearVector, to: LinearVector) -> Call {
    Call { vector_from: vector_number(from), vector_to: vector_number(to), ..Call::default() }
}
