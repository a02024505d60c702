//! Newton's method where triangles touch (NUMERICS §15): each iterate is one that they can reach.

use crate::{
    ImplicitSettings, Kernels, LinearStart, LinearStop, LinearVector, Model, NewtonSettings,
    NewtonStart, Result, SolverReport,
};

use super::{
    super::Substep, HALVINGS_MAX, constraints_meet, controlled_system, fall, is_short, residual,
    residual_put, solve,
};

/// Iterations at most in a substep as long as the settings have it, if these do not ask for more.
const ITERATIONS_MAX: f64 = 8.0;

/// And in a shorter one, however short it is: what one leaves is the next one's, and comes soon.
const ITERATIONS_LEAST: f64 = 4.0;

/// Halvings at most of a step that the certificate has stopped somewhere.
const STOPPED_HALVINGS_MAX: u32 = 4;

/// Of the residual that a longer step has left, a halved one has to leave no more for there to be another.
const WORTH: f64 = 0.7;

/// How much larger than the tolerance of the settings the residual may be that a linear solve leaves, in proportion to that of the first
/// system of the substep: its solution is good for one iteration alone.
const FORCING: f64 = 3.0;

/// A linear solve goes on at least until this share of its own residual is left.
const SHARE_MAX: f64 = 0.3;

/// Largest correction of the velocities that no iteration follows, in the norm of the matrix, if settings do not ask for Newton iterations and so for
/// another: relative to the first correction of the substep, or to what gravity gives, or that of the earth if there is none, if that is more.
const CORRECTION: f64 = 0.05;

/// The first correction ends it alone if it is this share of that: what is at rest needs no second look. With more, rounding in single precision
/// keeps a stack trembling at 3 mm/s.
const FIRST_ALONE: f64 = 0.1;

/// The first correction counts up to so many times what gravity gives: where cloth is stopped all at once it is far more, and a share of it would be
/// stretch that stays.
const FIRST_MAX: f64 = 20.0;

/// A correction up to so many times that one ends the iteration too where none gains any more: a few particles then go back and forth, and all others wait.
const STALLED: f64 = 4.0;

/// Nothing is gained by two iterations that leave more than this of the square of the correction before them.
const GAIN: f64 = 0.5;

/// And relative to the tolerance of linear systems, if that asks for less.
const CORRECTION_FORCING: f64 = 50.0;

/// Standard gravity \[m/s^2\].
const EARTH: f64 = 9.81;

/// The first system of fabric: about where the velocities of the start lead to, as far as particles can get there. What turns along the way is longer
/// by the square of its angle there, and a system about the start knows nothing of it: its solution would have to be mended by the next.
///
/// # Errors
/// Those of the stages.
pub(super) fn predict<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    kernels.position_from_kept(substep.length)?;
    kernels.contact_certify_iterate(substep)?;
    controlled_system(kernels, substep, NewtonStart::Iterate)?;
    kernels.iterate_keep()
}

/// The first solve and the iterations after it. Returns what the last system was linearised about, or nothing if one could not be solved.
///
/// An iterate ends where the certificate lets particles go from the iterate before: what would pass is stopped there, the next system knows what it
/// touches, and cloth around it gives way within the same substep. Stopped particles draw cloth out: where more of the residual is left than before, all
/// of the step is halved, so that less is stopped, as long as that pays. What is touched on the way begins to push all at once, so that the slope of a shorter
/// step, which nothing stops, may be as steep as of the long one: it is not asked any more then, and the next system knows of the push.
///
/// The solution of each system is good for one iteration, so that it is not solved to the end (Dembo, Eisenstat and Steihaug 1982) but to a
/// share of what the substep began with, and constraints of colliders that pull are released from one to the next. The iteration ends by the size of its corrections, the first one apart, not by the residual, of which rounding leaves much where cloth is stiff. Of a
/// correction that was stopped what counts is what moved: the load on cloth that lies pressed between bodies asks for the same again and again, and gets none of it.
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
    let NewtonSettings { iterations_max, tolerance } = settings.newton;
    let is_asked = iterations_max > 1;
    let linear = settings.linear.tolerance;
    let correction = if is_asked { tolerance } else { CORRECTION.min(CORRECTION_FORCING * linear) };
    let share = substep.length / kernels.config().time_step;
    let usual = (ITERATIONS_MAX * share).ceil().clamp(ITERATIONS_LEAST, ITERATIONS_MAX);
    let iterations_max = iterations_max.max(usual as u32);
    let is_linear = !is_asked && !kernels.model().has_fabric();
    let keeps_impulses = kernels.model().collider_impulses();
    let mut solves = ImplicitSettings { constraint_passes: 1, ..*settings };
    let was_free = is_linear && !kernels.triangles_touch();
    let is_loose = settings.linear.stop == LinearStop::Residual && !was_free;
    let gravity = substep.length * substep.length * weight(kernels.model());
    let mut scale = gravity;
    let mut end =
        if kernels.model().has_fabric() { NewtonStart::Iterate } else { NewtonStart::StepStart };
    if start == LinearStart::Constraints && kernels.model().has_fabric() {
        start = fall::start(kernels, substep, settings, gravity)?;
    }
    let first = residual(kernels)?;
    let mut now = first;
    // The smallest correction before the last one, and the last one.
    let [mut smallest, mut last] = [f64::INFINITY; 2];
    for iteration in 1..=iterations_max {
        let is_last = iteration == iterations_max;
        if is_loose && now > 0.0 {
            let share = (FORCING * linear * first / now).min(SHARE_MAX);
            solves.linear.tolerance = share.max(linear);
        }
        if !solve(kernels, &solves, (start, is_last), report)? {
            return Ok(None);
        }
        start = LinearStart::Constraints;
        // The solver has left its own residual there.
        residual_put(kernels)?;
        let slope_start = kernels.vector_dot(Residual, Solution)?;
        constraints_meet(kernels)?;
        if iteration == 1 {
            scale = scale.max(slope_start.min(FIRST_MAX * FIRST_MAX * scale));
        }
        let enough = correction * if iteration == 1 { FIRST_ALONE } else { 1.0 };
        let [enough, enough_held] = [scale, gravity].map(|scale| enough * enough * scale);
        // What contacts did is told by the forces of the last system, which those at the start of a substep are not yet.
        let is_told = !keeps_impulses || end == NewtonStart::Iterate;
        let is_small = slope_start <= enough && is_told;
        let is_stalled =
            !is_asked && slope_start <= STALLED * STALLED * enough && slope_start > GAIN * smallest;
        (smallest, last) = (smallest.min(last), slope_start);
        let mut step = 1.0;
        if iteration > 1 {
            kernels.iterate_keep()?;
        }
        kernels.velocity_keep()?;
        kernels.velocity_add(step)?;
        let before = now;
        let mut longer = f64::INFINITY;
        let mut is_held = false;
        // Whether the certificate has stopped this step, or a longer one.
        let mut was_stopped = false;
        for halving in 0.. {
            kernels.position_from_kept(substep.length)?;
            let stopped = kernels.contact_certify_iterate(substep)?;
            let is_free = was_free && iteration == 1 && !kernels.triangles_touch();
            if is_small || (stopped == 0 && is_free) {
                return Ok(Some(end));
            }
            controlled_system(kernels, substep, NewtonStart::Iterate)?;
            end = NewtonStart::Iterate;
            now = residual(kernels)?;
            if !now.is_finite() {
                return Ok(None);
            }
            let slope = kernels.vector_dot(Residual, Solution)?;
            was_stopped |= stopped > 0;
            let is_good = match was_stopped {
                false => is_short(slope, slope_start),
                true => now <= before || halving == STOPPED_HALVINGS_MAX || now > WORTH * longer,
            };
            // A step that nothing stops does as much work as its slope at the start.
            is_held = stopped > 0 && (slope_start - slope).abs() <= enough_held;
            longer = now;
            if is_good || is_held || halving == HALVINGS_MAX {
                break;
            }
            step *= 0.5;
            kernels.velocity_restore()?;
            kernels.velocity_add(step)?;
        }
        if (is_last || is_stalled) && !is_held && slope_start > 0.0 && scale > 0.0 {
            report.newton_residual = report.newton_residual.max((slope_start / scale).sqrt());
        }
        if is_held || is_stalled {
            return Ok(Some(end));
        }
    }
    Ok(Some(end))
}

/// sum m g^2 over all particles that no pin holds; without gravity, that of the earth.
fn weight(model: &Model) -> f64 {
    let square: f64 = model.gravity().iter().map(|g| g * g).sum();
    let square = if square > 0.0 { square } else { EARTH * EARTH };
    let mut masses = model.masses().to_vec();
    model.pins().iter().for_each(|&pin| masses[pin as usize] = 0.0);
    square * masses.iter().filter(|mass| mass.is_finite()).sum::<f64>()
}
