//! The same input gives the same bits.

use cloth_core::{Backend, State};

use super::scenario::{FRAME_SUBSTEPS, Scenario};
use crate::{Verdict, bits::first_difference, verdict::ensure};

/// All `backends` end in the same bits.
///
/// # Errors
/// The first difference.
pub fn same_bits(backends: &[&dyn Backend], scenario: &Scenario) -> Verdict {
    let mut first: Option<State> = None;
    for (number, backend) in backends.iter().enumerate() {
        let state = scenario.run(*backend)?;
        let first = first.get_or_insert_with(|| state.clone());
        let difference = first_difference(first, &state);
        ensure(difference.is_none(), || {
            format!("{scenario:?}: run {number} differs from run 0 at particle {difference:?}")
        })?;
    }
    Ok(())
}

/// A run that is downloaded half way, and continued in a fresh solver, ends in the same bits as one
/// that was not interrupted.
///
/// # Errors
/// The first difference.
pub fn resumes_with_same_bits(backend: &dyn Backend, scenario: &Scenario) -> Verdict {
    let uninterrupted = scenario.run(backend)?;
    let mut half = State::default();
    let halves = scenario.substeps / FRAME_SUBSTEPS / 2 * FRAME_SUBSTEPS;
    let mut solver = scenario.solver(backend)?;
    solver.upload(&Scenario::start(&scenario.model()))?;
    scenario.advance(&mut *solver, halves)?;
    solver.download(&mut half)?;
    let mut solver = scenario.solver(backend)?;
    solver.upload(&half)?;
    scenario.advance(&mut *solver, scenario.substeps - halves)?;
    let mut resumed = State::default();
    solver.download(&mut resumed)?;
    let difference = first_difference(&uninterrupted, &resumed);
    ensure(difference.is_none(), || {
        format!("{scenario:?}: differs at particle {difference:?} after being continued")
    })?;
    ensure((uninterrupted.time, uninterrupted.step) == (resumed.time, resumed.step), || {
        "time or number of substeps differ after being continued".into()
    })
}
