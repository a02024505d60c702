//! The stages of the semi-implicit integrator.

use cloth_core::{LinearVector, Result, SemiImplicitKernels, SemiImplicitSolve, stepper::Substep};

use super::ReferenceKernels;
use crate::{
    check_solve,
    semi_implicit::{semi_implicit_factorise, semi_implicit_solve, torque_correct},
};

impl SemiImplicitKernels for ReferenceKernels {
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool> {
        check_solve(solve)?;
        let factorisations = &mut self.factorisations;
        semi_implicit_factorise(&self.model, &self.particles, length, factorisations)
    }

    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()> {
        let Some(factors) = self.factorisations.present() else { return Ok(()) };
        let (model, h) = (&self.model, substep.length);
        *self.linear.vector_mut(LinearVector::Solution) =
            semi_implicit_solve(model, &self.particles, &self.forces, h, factors);
        Ok(())
    }

    fn torque_correct(&mut self, substep: &Substep) -> Result<()> {
        let solution = self.linear.vector_mut(LinearVector::Solution);
        torque_correct(&self.model, &self.particles, &self.forces, substep.length, solution);
        Ok(())
    }
}
