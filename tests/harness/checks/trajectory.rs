//! Whole trajectories, as long as a bound of the error can be given.

use crate::{Verdict, backends::Candidate, models::Description, stages};

/// Substeps of `explicit_substep` against the plain loops.
///
/// The bound grows with the trajectory: the plain loops pass the error of one substep on to the next
/// as they do with every other error, by the absolute values of all derivatives.
///
/// # Errors
/// What is wrong.
pub fn trajectory(candidate: &Candidate, description: &Description, substeps: usize) -> Verdict {
    let case = description.case(candidate);
    let mut kernels = case.kernels(candidate)?;
    let mut expected = case.particles();
    for number in 0..substeps {
        let substep = &case.plan.substeps[number % case.plan.substeps.len()];
        kernels.explicit_substep(substep)?;
        stages::explicit_substep(&case.model, &case.config, &mut expected, &case.plan, substep);
    }
    super::motion::compare_state(candidate, &expected, &mut *kernels)
}
