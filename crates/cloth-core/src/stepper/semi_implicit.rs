//! Backward Euler with a constant matrix (NUMERICS §6).

use crate::{Kernels, NewtonStart, Result, SemiImplicitSettings, SolverReport};

use super::{Substep, finish, forces};

/// One semi-implicit substep, booked in `report`.
///
/// # Errors
/// Those of the stages.
pub fn substep<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    settings: &SemiImplicitSettings,
    report: &mut SolverReport,
) -> Result<()> {
    finish::collider_start(kernels)?;
    let factorised = kernels.semi_implicit_factorise(substep.length, settings.solve)?;
    report.factorisations += u32::from(factorised);
    report.solves += 1;
    forces::external(kernels, substep)?;
    kernels.spring_forces()?;
    forces::fabric(kernels)?;
    forces::contact(kernels, substep, NewtonStart::StepStart)?;
    kernels.semi_implicit_solve(substep)?;
    kernels.torque_correct(substep)?;
    kernels.velocity_add(1.0)?;
    finish::advance(kernels, substep)
}
