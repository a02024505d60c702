//! Newton's method where triangles touch (NUMERICS §15): each iterate is one that they can reach.

use crate::{
    ImplicitSettings, Kernels, LinearSettings, LinearStart, LinearStop, LinearVector, Model,
    NewtonStart, Result, SolverReport,
};

use super::{super::Substep, HALVINGS_MAX, constraints_meet, is_short, residual, solve, system};

/// Iterations at most, if settings do not ask for more.
const ITERATIONS_MAX: u32 = 8;

/// Largest correction of the velocities that no iteration follows, in the norm of the matrix, relative to what gravity gives them in the substep.
const CORRECTION: f64 = 0.05;

/// Relative residual at least to which the first linear system is solved, and those after it: their solutions are good for one iteration
/// alone.
const FORCING: [f64; 2] = [1e-2, 0.1];

/// The first solve and the iterations after it. Returns what the last system was linearised about, or nothing if one could not be solved.
///
/// An iterate ends where the certificate lets particles go: what would pass is stopped there, the next system knows what it touches, and
/// cloth around it gives way within the same substep. The solution of each system is good for one iteration, so that it is solved to a
/// share of its residual (Dembo, Eisenstat and Steihaug 1982), and constraints of colliders that pull are released from one to the
/// next. The iteration ends by the size of its corrections, not by the residual, of which rounding leaves much where cloth is stiff.
///
/// # Errors
/// Those of the stages.
pub(super) fn newton<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    (settings, mut start): (&ImplicitSettings, LinearStart),
    report: &mut SolverReport,
) -> Result<Option<NewtonStart>> {
    use LinearVector::{Residual, Solution};
    let iterations_max = settings.newton.iterations_max.max(ITERATIONS_MAX);
    let is_linear = settings.newton.iterations_max == 1 && !kernels.model().has_fabric();
    let keeps_impulses = kernels.model().collider_impulses();
    let mut solves = ImplicitSettings { constraint_passes: 1, ..*settings };
    let mut scale = substep.length * substep.length * weight(kernels.model());
    let mut end = NewtonStart::StepStart;
    residual(kernels)?;
    for iteration in 1..=iterations_max {
        let is_last = iteration == iterations_max;
        solves.linear.tolerance = forcing(&settings.linear, FORCING[usize::from(iteration > 1)]);
        if !solve(kernels, &solves, (start, is_last), report)? {
            return Ok(None);
        }
        start = LinearStart::Constraints;
        // The solver has left its own residual there.
        residual(kernels)?;
        let slope_start = kernels.vector_dot(Residual, Solution)?;
        if scale == 0.0 {
            scale = slope_start;
        }
        constraints_meet(kernels)?;
        let is_small = slope_start <= CORRECTION * CORRECTION * scale && !keeps_impulses;
        let mut step = 1.0;
        kernels.velocity_add(step)?;
        for halving in 0.. {
            kernels.position_from_kept(substep.length)?;
            let stopped = kernels.contact_certify_iterate(substep)?;
            let is_free = is_linear && iteration == 1 && !kernels.triangles_touch();
            if stopped == 0 && (is_small || is_free) {
                return Ok(Some(end));
            }
            system(kernels, substep, NewtonStart::Iterate)?;
            end = NewtonStart::Iterate;
            if !residual(kernels)?.is_finite() {
                return Ok(None);
            }
            let slope = kernels.vector_dot(Residual, Solution)?;
            if stopped > 0 || is_short(slope, slope_start) || halving == HALVINGS_MAX {
                break;
            }
            step *= 0.5;
            kernels.velocity_add(-step)?;
        }
        if is_last && slope_start > 0.0 && scale > 0.0 {
            report.newton_residual = report.newton_residual.max((slope_start / scale).sqrt());
        }
    }
    Ok(Some(end))
}

/// The tolerance of a linear system whose solution is good for one iteration alone.
fn forcing(linear: &LinearSettings, least: f64) -> f64 {
    let is_given = linear.tolerance == 0.0 || linear.stop == LinearStop::Energy;
    if is_given { linear.tolerance } else { linear.tolerance.max(least) }
}

/// sum m g^2 over all particles.
fn weight(model: &Model) -> f64 {
    let square: f64 = model.gravity().iter().map(|g| g * g).sum();
    square * model.masses().iter().filter(|mass| mass.is_finite()).sum::<f64>()
}
