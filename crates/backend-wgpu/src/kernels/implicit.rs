//! The stages of the implicit integrator on a GPU: not offered yet, but for the copies
//! that an adaptive time step needs.

use cloth_core::{
    ConstraintStatistics, Error, ImplicitKernels, LinearOutcome, LinearVector, MatrixBlock,
    MatrixForm, NewtonStart, Preconditioner, Result, stepper::Substep,
};

use super::WgpuKernels;
use crate::{contact::Command, fault::BACKEND};

fn unsupported() -> Error {
    Error::Unsupported { backend: BACKEND, feature: "the implicit integrator".into() }
}

impl ImplicitKernels for WgpuKernels {
    fn state_keep(&mut self) -> Result<()> {
        self.stages.execute(Command::StateKeep)
    }

    fn state_restore(&mut self) -> Result<()> {
        self.stages.execute(Command::StateRestore)
    }

    fn spring_linearise(&mut self, _: &Substep) -> Result<()> {
        Err(unsupported())
    }

    fn contact_linearise(&mut self, _: &Substep) -> Result<()> {
        Err(unsupported())
    }

    fn implicit_assemble(&mut self, _: &Substep, _: NewtonStart) -> Result<()> {
        Err(unsupported())
    }

    fn collider_constraints(&mut self, _: &Substep) -> Result<()> {
        Err(unsupported())
    }

    fn constraint_release(&mut self) -> Result<u64> {
        Err(unsupported())
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        Ok(ConstraintStatistics::default())
    }

    fn constraint_filter(&mut self, _: LinearVector) -> Result<()> {
        Err(unsupported())
    }

    fn constraint_project(&mut self, _: LinearVector) -> Result<()> {
        Err(unsupported())
    }

    fn matrix_apply(&mut self, _: MatrixForm, _: LinearVector, _: LinearVector) -> Result<()> {
        Err(unsupported())
    }

    fn preconditioner_build(&mut self, _: Preconditioner) -> Result<()> {
        Err(unsupported())
    }

    fn preconditioner_apply(&mut self, _: LinearVector, _: LinearVector) -> Result<()> {
        Err(unsupported())
    }

    fn vector_dot(&mut self, _: LinearVector, _: LinearVector) -> Result<f64> {
        Err(unsupported())
    }

    fn vector_combine(&mut self, _: (f64, LinearVector), _: (f64, LinearVector)) -> Result<()> {
        Err(unsupported())
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        Err(unsupported())
    }

    fn velocity_add(&mut self, _: f64) -> Result<()> {
        Err(unsupported())
    }

    fn position_advance(&mut self, _: f64) -> Result<()> {
        Err(unsupported())
    }

    fn position_from_kept(&mut self, _: f64) -> Result<()> {
        Err(unsupported())
    }

    fn matrix_read(&mut self, _: &mut Vec<MatrixBlock>) -> Result<()> {
        Err(unsupported())
    }

    fn vector_read(&mut self, _: LinearVector, _: &mut Vec<[f64; 3]>) -> Result<()> {
        Err(unsupported())
    }

    fn vector_write(&mut self, _: LinearVector, _: &[[f64; 3]]) -> Result<()> {
        Err(unsupported())
    }
}
