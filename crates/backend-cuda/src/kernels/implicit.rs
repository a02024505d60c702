//! The stages of the implicit integrator.

use cloth_core::{
    ConstraintStatistics, Error, ImplicitKernels, LinearOutcome, LinearVector, MatrixBlock,
    MatrixForm, NewtonStart, Preconditioner, Result, stepper::Substep,
};

use super::CudaKernels;
use crate::{fault::BACKEND, layout::CudaReal};

fn unsupported<R>(feature: &str) -> Result<R> {
    Err(Error::Unsupported { backend: BACKEND, feature: feature.to_owned() })
}

impl<T: CudaReal> CudaKernels<T> {
    /// Particles may have been held or released.
    pub(super) fn pins_changed(&mut self) {}
}

impl<T: CudaReal> ImplicitKernels for CudaKernels<T> {
    fn state_keep(&mut self) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn state_restore(&mut self) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn spring_linearise(&mut self, _: &Substep) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn contact_linearise(&mut self, _: &Substep) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn implicit_assemble(&mut self, _: &Substep, _: NewtonStart) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn collider_constraints(&mut self, _: &Substep) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn constraint_release(&mut self) -> Result<u64> {
        unsupported("the implicit integrator")
    }
    fn constraint_statistics(&mut self) -> Result<ConstraintStatistics> {
        Ok(ConstraintStatistics::default())
    }
    fn constraint_filter(&mut self, _: LinearVector) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn constraint_project(&mut self, _: LinearVector) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn matrix_apply(&mut self, _: MatrixForm, _: LinearVector, _: LinearVector) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn preconditioner_build(&mut self, _: Preconditioner) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn preconditioner_apply(&mut self, _: LinearVector, _: LinearVector) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn vector_dot(&mut self, _: LinearVector, _: LinearVector) -> Result<f64> {
        unsupported("the implicit integrator")
    }
    fn vector_combine(&mut self, _: (f64, LinearVector), _: (f64, LinearVector)) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn direct_solve(&mut self) -> Result<LinearOutcome> {
        unsupported("the direct solver")
    }
    fn velocity_add(&mut self, _: f64) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn position_advance(&mut self, _: f64) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn position_from_kept(&mut self, _: f64) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn matrix_read(&mut self, _: &mut Vec<MatrixBlock>) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn vector_read(&mut self, _: LinearVector, _: &mut Vec<[f64; 3]>) -> Result<()> {
        unsupported("the implicit integrator")
    }
    fn vector_write(&mut self, _: LinearVector, _: &[[f64; 3]]) -> Result<()> {
        unsupported("the implicit integrator")
    }
}
