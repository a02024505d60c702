//! The stages of the semi-implicit integrator on a GPU: the constant system is solved by iterations that
//! start from the substep before.

use cloth_core::{Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep};

use super::WgpuKernels;
use crate::contact::Command;

impl SemiImplicitKernels for WgpuKernels {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        self.stages.semi_implicit_check(solve)?;
        self.stages.execute(Command::SemiImplicitFactorise(length))?;
        Ok(false)
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::SemiImplicitSolve(*substep))
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        self.stages.execute(Command::TorqueCorrect(*substep))
    }
}
