//! The choice of the integrator.

use crate::{Integrator, Kernels, Result, SolverReport};

use super::{Substep, semi_implicit};

/// One substep of the integrator, the forces that were given from outside first. Returns whether it could be done;
/// if not, a linear solve broke down, and the state is that of its start.
///
/// # Errors
/// Those of the stages.
pub(super) fn substep<K: Kernels>(
    kernels: &mut K,
    substep: &Substep,
    integrator: &Integrator,
    report: &mut SolverReport,
) -> Result<bool> {
    // The matrix of an implicit step has them.
    let kicks = kernels.has_control_forces() && !matches!(integrator, Integrator::Implicit(_));
    if kicks {
        kernels.control_forces(substep)?;
    }
    let done = match integrator {
        Integrator::Explicit => kernels.explicit_substep(substep).map(|()| true),
        Integrator::Implicit(settings) => kernels.implicit_substep(substep, settings, report),
        Integrator::Midpoint(settings) => kernels.midpoint_substep(substep, settings, report),
        Integrator::SemiImplicit(settings) => {
            semi_implicit::substep(kernels, substep, settings, report).map(|()| true)
        }
    }?;
    if kicks && !done {
        // The state that was put back is the one after the kick.
        kernels.control_forces_restore()?;
    }
    Ok(done)
}
