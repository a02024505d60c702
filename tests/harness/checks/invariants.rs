//! What holds in every state of a simulation with contact, where trajectories cannot be compared:
//! after the first touch they part as fast as rounding errors grow.

use cloth_core::State;

use super::scenario::{FRAME_SUBSTEPS, Scenario};
use crate::{Verdict, backends::Candidate, verdict::ensure};

/// Penetration, momentum, energy and strain, after every few substeps.
///
/// # Errors
/// What is wrong.
pub fn invariants(candidate: &Candidate, scenario: &Scenario) -> Verdict {
    let mut solver = scenario.solver(&*candidate.backend)?;
    let start = Scenario::start(&scenario.model());
    solver.upload(&start)?;
    let mut energy_start = None;
    let mut state = State::default();
    for _ in 0..scenario.substeps / FRAME_SUBSTEPS {
        solver.advance(scenario.frame())?;
        let measures = solver.synchronize()?.measures;
        let fail = |what: &str, found: f64| format!("{}: {what} is {found:e}", candidate.label);
        // Colliders come last: what remains is the rounding of coordinates below 1 m.
        let penetration = measures.penetration_max;
        ensure(penetration <= 4.0 * candidate.epsilon(), || fail("penetration", penetration))?;
        // Internal forces cancel but for the rounding of k (l - L), L = 10 times the elongation.
        let drift = measures.momentum_drift;
        ensure(drift <= 100.0 * candidate.epsilon(), || fail("momentum drift", drift))?;
        // One sweep leaves some springs longer than the limit of 10 %, none by much.
        let strain = measures.strain_max;
        ensure(strain <= 0.3, || fail("strain", strain))?;
        // Nothing drives the cloth.
        let energy = measures.energy();
        let first = *energy_start.get_or_insert(energy);
        ensure(energy <= 1.01 * first, || fail("energy", energy))?;
        solver.download(&mut state)?;
        let lowest = state.positions.iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
        ensure(lowest > 0.0, || fail("height above the ground", lowest))?;
    }
    Ok(())
}
