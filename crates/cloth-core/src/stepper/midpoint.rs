//! The implicit midpoint rule, a little off the middle (NUMERICS §5).

use crate::{
    Field, Kernels, LinearStart, MidpointSettings, Model, NewtonStart, Result, SolverReport,
};

use super::{Substep, finish, implicit};

/// One substep, booked in `report`: a velocity within the substep from one iteration of Newton's method, corrected so that it brings
/// pieces that nothing holds the angular momentum of the forces from outside alone, and the motion with it.
///
/// Returns whether it could be done. If not, the linear solve broke down, and the state is that of the start of the substep.
///
/// # Errors
/// Those of the stages.
pub fn substep<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    settings: &MidpointSettings,
    report: &mut SolverReport,
) -> Result<bool> {
    kernels.state_keep()?;
    kernels.preconditioner_forget();
    finish::collider_start(kernels)?;
    let whole = substep.length;
    let part = Substep { length: settings.weight * whole, ..*substep };
    // Where the velocities of the start lead to: a motion along tangents stretches what turns, and forces have to know of it.
    kernels.position_from_kept(part.length)?;
    implicit::system(kernels, &part, NewtonStart::Iterate)?;
    report.newton_iterations += 1;
    let start = LinearStart::Constraints;
    if implicit::system_solve(kernels, &settings.linear, start, report)?.breakdown {
        kernels.state_restore()?;
        return Ok(false);
    }
    if keeps_angular_momentum(kernels.model()) {
        kernels.position_from_kept(whole - part.length)?;
        kernels.torque_correct(&part)?;
    }
    // The way with the velocity within the substep, told as one back and one forth with that of its end: contact by impulses divides the
    // latter, and changes velocities on it.
    kernels.velocity_add(1.0)?;
    kernels.position_from_kept(whole)?;
    kernels.velocity_add(settings.weight.recip() - 1.0)?;
    kernels.position_advance(-whole)?;
    finish::advance(kernels, substep)?;
    Ok(true)
}

/// Whether the angular momentum of a piece changes by forces alone that are not in the matrix. Air, drag and penalties are: with
/// them a correction would make them explicit, and unstable in long substeps.
#[must_use]
pub fn keeps_angular_momentum(model: &Model) -> bool {
    let is_matrix_free = |field: &Field| !matches!(field, Field::Drag { .. });
    model.air().is_none()
        && model.fields().iter().all(is_matrix_free)
        && !model.self_contact().is_some_and(|contact| {
            matches!(contact.response, crate::ContactResponse::Penalty { .. })
        })
}
