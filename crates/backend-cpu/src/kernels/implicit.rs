//! The stages of the implicit integrator on the CPU.

use cloth_core::{
    ConstraintStatistics, Error, ImplicitKernels, LinearOutcome, LinearVector, MatrixBlock,
    MatrixForm, NewtonStart, Preconditioner, Real, Result, stepper::Substep,
};

use super::CpuKernels;

fn unsupported<R>() -> Result<R> {
    Err(Error::Unsupported { backend: "cpu", feature: "the implicit integrator".into() })
}

impl<T: Real> ImplicitKernels for CpuKernels<T> {
    fn state_keep(&mut self) -> Result<()> {
        unsupported()
    }

    fn state_restore(&mut self) -> Result<()> {
        unsupported()
    }

    fn spring_linearise(&mut self, _: &Substep) -> Result<()> {
        unsupported()
    }

    fn contact_linearise(&mut self, _: &Substep) -> Result<()> {
        unsupported()
    }

    fn implicit_assemble(&mut self, _: &Substep, _: NewtonStart) -> Result<()> {
        unsupported()
    }

    fn collider_constraints(&mut self, _: &Substep) -> Result<()> {
        unsupported()
    }

    fn constraint_release(&mut self) -> Result<u64> {
        unsupported()
    }

    fn constraint_friction(&mut self) -> Result<()> {
        unsupported()
    }

    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        Ok(ConstraintStatistics::default())
    }

    fn constraint_filter(&mut self, _: LinearVector) -> Result<()> {
        unsupported()
    }

    fn constraint_project(&mut self, _: LinearVector) -> Result<()> {
        unsupported()
    }

    fn matrix_apply(&mut self, _: MatrixForm, _: LinearVector, _: LinearVector) -> Result<()> {
        unsupported()
    }

    fn preconditioner_build(&mut self, _: Preconditioner) -> Result<()> {
        unsupported()
    }

    fn preconditioner_apply(&mut self, _: LinearVector, _: LinearVector) -> Result<()> {
        unsupported()
    }

    fn vector_dot(&mut self, _: LinearVector, _: LinearVector) -> Result<f64> {
        unsupported()
    }

    fn vector_combine(&mut self, _: (f64, LinearVector), _: (f64, LinearVector)) -> Result<()> {
        unsupported()
    }

    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        unsupported()
    }

    fn velocity_add(&mut self, _: f64) -> Result<()> {
        unsupported()
    }

    fn position_advance(&mut self, _: f64) -> Result<()> {
        unsupported()
    }

    fn position_from_kept(&mut self, _: f64) -> Result<()> {
        unsupported()
    }

    fn matrix_read(&mut self, _: &mut Vec<MatrixBlock>) -> Result<()> {
        unsupported()
    }

    fn vector_read(&mut self, _: LinearVector, _: &mut Vec<[f64; 3]>) -> Result<()> {
        unsupported()
    }

    fn vector_write(&mut self, _: LinearVector, _: &[[f64; 3]]) -> Result<()> {
        unsupported()
    }
}
