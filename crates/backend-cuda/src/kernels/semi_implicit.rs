//! The stages of the semi-implicit integrator.

use cloth_core::{Error, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep};

use super::CudaKernels;
use crate::{fault::BACKEND, layout::CudaReal};

fn unsupported<R>() -> Result<R> {
    let feature = "the semi-implicit integrator".to_owned();
    Err(Error::Unsupported { backend: BACKEND, feature })
}

impl<T: CudaReal> SemiImplicitKernels for CudaKernels<T> {
    fn semi_implicit_factorise(&mut self, _: f64, _: SemiImplicitSolve) -> Result<bool> {
        unsupported()
    }
    fn semi_implicit_solve(&mut self, _: &Substep) -> Result<()> {
        unsupported()
    }
    fn torque_correct(&mut self, _: &Substep) -> Result<()> {
        unsupported()
    }
}
