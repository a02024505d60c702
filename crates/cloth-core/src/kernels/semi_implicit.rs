//! The stages of the semi-implicit integrator.

use crate::{Result, SemiImplicitSolve, stepper::Substep};

/// The stages of NUMERICS §6: a constant matrix, factorised once.
pub trait SemiImplicitKernels: Send {
    /// NUMERICS §6: makes sure that the constant matrix is factorised for this length of substep
    /// \[s\] and the particles held at present. Returns whether that had to be done.
    ///
    /// # Errors
    /// `Unsupported` for a kind of solve that the backend does not have; `OutOfMemory`.
    fn semi_implicit_factorise(&mut self, length: f64, solve: SemiImplicitSolve) -> Result<bool>;

    /// NUMERICS §6: the change of velocity, as the solution of the linear system, from f with all
    /// forces.
    ///
    /// # Errors
    /// What the device reports.
    fn semi_implicit_solve(&mut self, substep: &Substep) -> Result<()>;

    /// NUMERICS §6: takes from the solution the angular momentum that filtering added to pieces
    /// that nothing holds.
    ///
    /// # Errors
    /// What the device reports.
    fn torque_correct(&mut self, substep: &Substep) -> Result<()>;
}
