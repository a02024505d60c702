//! Backward Euler (NUMERICS §5).

use crate::{
    ImplicitSettings, Kernels, LinearStart, LinearVector, NewtonSettings, NewtonStart, Result,
    SolverReport,
};

mod fall;
mod inexact;
mod system_solve;

pub(super) use system_solve::system_solve;

use super::{Substep, finish, forces};

/// Halvings of a Newton step at most.
const HALVINGS_MAX: u32 = 10;

/// A Newton step is too long if the slope at its end is more than this share of that at its start,
/// and positive.
const SLOPE_MAX: f64 = 0.9;

/// One implicit substep, booked in `report`: the velocity at its end from Newton's method under the constraints of
/// colliders, then the motion with that velocity, contact between cloths along the way.
///
/// Returns whether it could be done. If not, a linear solve broke down, and the state is that of the
/// start of the substep.
///
/// # Errors
/// Those of the stages.
pub fn substep<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    settings: &ImplicitSettings,
    report: &mut SolverReport,
) -> Result<bool> {
    kernels.state_keep()?;
    kernels.preconditioner_forget();
    finish::collider_start(kernels)?;
    if kernels.model().has_collider_constraints() {
        kernels.collider_constraints(substep)?;
    }
    if kernels.model().has_triangle_contact() && kernels.model().has_fabric() {
        inexact::predict(kernels, substep)?;
    } else {
        controlled_system(kernels, substep, NewtonStart::StepStart)?;
    }
    let start = if settings.linear.warm_start && substep.index > 0 {
        LinearStart::Solution
    } else {
        LinearStart::Constraints
    };
    let done = if kernels.model().has_triangle_contact() {
        inexact::newton(kernels, substep, (settings, start), report)?
    } else {
        let iterates = settings.newton.iterations_max > 1;
        let mut solved = solve(kernels, settings, (start, !iterates), report)?;
        if solved && iterates {
            solved = newton(kernels, substep, settings, report)?;
        } else if solved {
            kernels.velocity_add(1.0)?;
        }
        let end = if iterates { NewtonStart::Iterate } else { NewtonStart::StepStart };
        solved.then_some(end)
    };
    let Some(end) = done else {
        kernels.state_restore()?;
        return Ok(false);
    };
    kernels.position_from_kept(0.0)?;
    advance(kernels, substep, end)?;
    Ok(true)
}

/// The end of a substep, once the velocities are found: impulses of the constraints, motion, contact
/// between cloths along the way, strain limiting, colliders. `end` says what the last system was
/// linearised about, as in [`constraint_impulses`](crate::ImplicitKernels::constraint_impulses).
///
/// # Errors
/// Those of the stages.
pub fn advance<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    end: NewtonStart,
) -> Result<()> {
    if kernels.model().collider_impulses() && kernels.model().has_collider_constraints() {
        kernels.constraint_impulses(end)?;
    }
    finish::advance(kernels, substep)
}

/// [`system`] with the forces on single particles that are given from outside.
///
/// # Errors
/// Those of the stages.
pub fn controlled_system<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    start: NewtonStart,
) -> Result<()> {
    system(kernels, substep, start)?;
    if kernels.has_control_forces() {
        kernels.control_forces_assemble(substep, start)?;
    }
    Ok(())
}

/// Matrix and right-hand side at the present state: forces but those of springs, what is linearised,
/// and their sum.
///
/// # Errors
/// Those of the stages.
pub fn system<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    start: NewtonStart,
) -> Result<()> {
    forces::external(kernels, substep)?;
    kernels.spring_linearise(substep)?;
    if kernels.model().has_fabric() {
        kernels.membrane_linearise(substep, start)?;
        kernels.bending_linearise(substep, start)?;
    }
    forces::contact(kernels, substep, start)?;
    if kernels.contact_is_penalty() || kernels.model().has_triangle_contact() {
        kernels.contact_linearise(substep)?;
    }
    kernels.implicit_assemble(substep, start)
}

/// Solves the system, again as long as contacts are released. Returns whether it could. `is_final` says
/// that no other system of the substep comes after it.
fn solve<K: Kernels + ?Sized>(
    kernels: &mut K,
    settings: &ImplicitSettings,
    (mut start, is_final): (LinearStart, bool),
    report: &mut SolverReport,
) -> Result<bool> {
    let constrained = kernels.model().has_collider_constraints();
    // A contact that pulled in the very last solve has to be there when its impulse is looked for.
    let keeps = is_final && kernels.model().collider_impulses();
    report.newton_iterations += 1;
    for pass in 0..settings.constraint_passes {
        if system_solve(kernels, &settings.linear, start, report)?.breakdown {
            return Ok(false);
        }
        let last = pass + 1 == settings.constraint_passes;
        if !constrained || (last && keeps) {
            break;
        }
        if kernels.constraint_release()? == 0 || last {
            break;
        }
        start = LinearStart::Solution;
    }
    Ok(true)
}

/// Newton iterations after the first solve, each with a line search: the step is halved as long as
/// the residual at its end points back along it. Returns whether the systems could be solved.
fn newton<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    settings: &ImplicitSettings,
    report: &mut SolverReport,
) -> Result<bool> {
    use LinearVector::{Residual, Solution};
    let NewtonSettings { iterations_max, tolerance } = settings.newton;
    let mut first = None;
    for iteration in 1.. {
        // The solver has left its own residual there.
        let start = residual(kernels)?;
        let first = *first.get_or_insert(start);
        let slope_start = kernels.vector_dot(Residual, Solution)?;
        constraints_meet(kernels)?;
        let mut scale = 1.0;
        let mut left = f64::INFINITY;
        kernels.velocity_add(scale)?;
        for halving in 0.. {
            kernels.position_from_kept(substep.length)?;
            controlled_system(kernels, substep, NewtonStart::Iterate)?;
            left = residual(kernels)?;
            let slope = kernels.vector_dot(Residual, Solution)?;
            if is_short(slope, slope_start) || halving == HALVINGS_MAX {
                break;
            }
            scale *= 0.5;
            kernels.velocity_add(-scale)?;
        }
        let relative = if first > 0.0 { left / first } else { 0.0 };
        if iteration == iterations_max || relative <= tolerance || !relative.is_finite() {
            report.newton_residual = report.newton_residual.max(relative);
            return Ok(relative.is_finite());
        }
        let is_final = iteration + 1 == iterations_max;
        if !solve(kernels, settings, (LinearStart::Constraints, is_final), report)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether a Newton step has not gone too far, by its slopes at both ends.
fn is_short(slope: f64, slope_start: f64) -> bool {
    -slope <= SLOPE_MAX * slope_start.abs()
}

/// Gives the velocities what constraints ask for, and leaves the free part of the step as the
/// solution: a line search that shortened both would leave constraints unmet.
fn constraints_meet<K: Kernels + ?Sized>(kernels: &mut K) -> Result<()> {
    use LinearVector::{Direction, Image, Solution};
    kernels.vector_combine((1.0, Solution), (0.0, Image))?;
    kernels.vector_combine((0.0, Image), (0.0, Direction))?;
    kernels.constraint_project(Direction)?;
    kernels.vector_combine((1.0, Direction), (0.0, Solution))?;
    kernels.velocity_add(1.0)?;
    kernels.vector_combine((-1.0, Direction), (1.0, Image))?;
    kernels.vector_combine((1.0, Image), (0.0, Solution))
}

/// Puts S b, what is left of the nonlinear system at the present iterate, into the residual.
fn residual_put<K: Kernels + ?Sized>(kernels: &mut K) -> Result<()> {
    use LinearVector::{Residual, RightSide};
    kernels.vector_combine((1.0, RightSide), (0.0, Residual))?;
    kernels.constraint_filter(Residual)
}

/// The same, and its length.
fn residual<K: Kernels + ?Sized>(kernels: &mut K) -> Result<f64> {
    residual_put(kernels)?;
    Ok(kernels.vector_dot(LinearVector::Residual, LinearVector::Residual)?.sqrt())
}
