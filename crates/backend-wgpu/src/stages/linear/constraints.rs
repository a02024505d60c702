//! What colliders and pins demand.

use cloth_core::{
    ConstraintStatistics, LinearVector, MatrixForm, NewtonStart, Result, stepper::Substep,
};

use super::{Stages, vectors_call};
use crate::layout::{CALL_ITERATE, Call, Solve};

impl Stages {
    pub(in crate::stages) fn collider_constraints(&mut self, substep: &Substep) -> Result<()> {
        if self.model.colliders().is_empty() {
            return Ok(());
        }
        self.linear_prepare()?;
        self.constrained = None;
        if !self.is_batch {
            self.constrained_reset()?;
        }
        let slot = self.slot(substep)?;
        self.linear_kernel("collider_constraints", slot, Call::default())
    }

    pub(in crate::stages) fn constraint_impulses(&mut self, start: NewtonStart) -> Result<()> {
        if !self.model.collider_impulses() || self.model.colliders().is_empty() {
            return Ok(());
        }
        self.linear_prepare()?;
        let flags = if start == NewtonStart::Iterate { CALL_ITERATE } else { 0 };
        if start == NewtonStart::StepStart {
            let (from, to) = (LinearVector::Solution, LinearVector::Image);
            self.matrix_apply(MatrixForm::MatrixFree, from, to)?;
        }
        self.linear_kernel("constraint_impulses", 0, Call { flags, ..Call::default() })
    }

    pub(crate) fn constraint_filter(&mut self, vector: LinearVector) -> Result<()> {
        self.linear_kernel("constraint_filter", 0, vectors_call(vector, vector))
    }

    pub(crate) fn constraint_project(&mut self, vector: LinearVector) -> Result<()> {
        self.linear_kernel("constraint_project", 0, vectors_call(vector, vector))
    }

    /// Records the stage; the number of changes stays on the device.
    pub(super) fn constraint_release_record(&mut self) -> Result<()> {
        let (from, to) = (LinearVector::Solution, LinearVector::Image);
        self.matrix_apply(MatrixForm::MatrixFree, from, to)?;
        self.linear_kernel("constraint_release", 0, Call::default())
    }

    /// Runs the stage and waits for the number of changes.
    pub(crate) fn constraint_release(&mut self) -> Result<u64> {
        if self.model.colliders().is_empty() {
            return Ok(0);
        }
        self.linear_prepare()?;
        // Nothing is left out: a solve that was never begun counts as one that ended.
        let phase = std::mem::offset_of!(Solve, next);
        self.solve_write(phase, &[crate::layout::SOLVE_ENDED])?;
        self.solve_write(std::mem::offset_of!(Solve, changed), &[0])?;
        self.constraint_release_record()?;
        let changed = u64::from(self.solve_read()?.changed);
        self.solve_write(std::mem::offset_of!(Solve, released), &[0])?;
        self.released += changed;
        Ok(changed)
    }

    pub(crate) fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        if !self.buffers.has("solve") || self.model.colliders().is_empty() {
            return Ok(ConstraintStatistics::default());
        }
        self.settle()?;
        let constrained = match self.constrained {
            Some(constrained) => constrained,
            None => u64::from(self.solve_read()?.constrained),
        };
        self.constrained = Some(constrained);
        Ok(ConstraintStatistics { constrained, released: std::mem::take(&mut self.released) })
    }
}
