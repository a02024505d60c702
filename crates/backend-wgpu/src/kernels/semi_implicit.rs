//! The stages of the semi-implicit integrator on a GPU: not offered yet.

use cloth_core::{Error, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep};

use super::WgpuKernels;
use crate::fault::BACKEND;

fn unsupported() -> Error {
    Error::Unsupported { backend: BACKEND, feature: "the semi-implicit integrator".into() }
}

impl SemiImplicitKernels for WgpuKernels {
    fn semi_implicit_factorise(&mut self, _: f64, _: SemiImplicitSolve) -> Result<bool> {
        Err(unsupported())
    }

    fn semi_implicit_solve(&mut self, _: &Substep) -> Result<()> {
        Err(unsupported())
    }

    fn torque_correct(&mut self, _: &Substep) -> Result<()> {
        Err(unsupported())
    }
}
