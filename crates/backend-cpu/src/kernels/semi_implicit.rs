//! The stages of the semi-implicit integrator on the CPU.

use cloth_core::{Error, Real, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep};

use super::CpuKernels;

fn unsupported<R>() -> Result<R> {
    Err(Error::Unsupported { backend: "cpu", feature: "the semi-implicit integrator".into() })
}

impl<T: Real> SemiImplicitKernels for CpuKernels<T> {
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
