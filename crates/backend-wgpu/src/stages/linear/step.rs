//! An implicit substep without contact or colliders: one kernel before the iterations, one after them.

use cloth_core::{Error, Result, stepper::Substep};

use super::{Stages, solve::stage_of};
use crate::{
    forms,
    layout::{CALL_DEFERRED, CALL_FROM_SOLUTION, Call},
    linear::{SolveRequest, call_of},
};

impl Stages {
    /// Whether substeps of this model can be done so, on a device that can bind enough buffers.
    pub(in crate::stages) fn implicit_step_prepare(&mut self) -> Result<bool> {
        if !forms::takes(forms::IMPLICIT_STEP, &self.model, &self.config) {
            return Ok(false);
        }
        match self.kernel("implicit_system") {
            Err(Error::LimitExceeded { .. }) => Ok(false),
            other => other.map(|_| true),
        }
    }

    /// Whether an implicit substep is to be one command.
    pub(crate) const fn steps_at_once(&self) -> bool {
        self.is_step_fused && self.defers() && !self.has_control_forces()
    }

    /// Records such a substep.
    pub(in crate::stages) fn implicit_step(
        &mut self,
        substep: &Substep,
        request: &SolveRequest,
    ) -> Result<()> {
        self.semi_implicit.length = None;
        let slot = self.slot(substep)?;
        let method = request.linear.method;
        let settings = call_of(&request.linear, request.start);
        let call = Call { flags: settings.flags | CALL_DEFERRED, pass_count: 1, ..settings };
        self.blocks_dispatch("implicit_system", self.present, slot, call)?;
        if call.flags & CALL_FROM_SOLUTION != 0 {
            self.residual_of_solution(stage_of(method), slot, call)?;
        }
        let after = self.solve_iterate_recorded(method, call)?;
        let next = self.free_motion();
        let after = Call { amount: substep.length as f32, ..after };
        self.blocks_dispatch("implicit_motion", next, slot, after)?;
        self.has_boxes[next] = false;
        self.present = next;
        Ok(())
    }

    /// A kernel over blocks of particles that writes motion `output`.
    fn blocks_dispatch(
        &mut self,
        name: &'static str,
        output: usize,
        slot: usize,
        call: Call,
    ) -> Result<()> {
        let call = self.call(call)?;
        let [blocks, _] = crate::dispatch::solve_blocks(self.particle_count());
        self.dispatch(name, name, (blocks, 1), output, (slot, call))
    }
}
