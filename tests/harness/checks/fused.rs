//! The composite stage is its parts.

use cloth_core::{State, stepper};

use crate::{
    Verdict, backends::Candidate, bits::first_difference, models::Description, verdict::ensure,
};

/// `explicit_substep` of a backend against the same stages run one by one: the same bits, through a
/// whole frame.
///
/// # Errors
/// What is wrong.
pub fn explicit_substep(candidate: &Candidate, description: &Description) -> Verdict {
    let case = description.case(candidate);
    let mut fused = case.kernels(candidate)?;
    let mut staged = case.kernels(candidate)?;
    let [mut fused_state, mut staged_state] = [State::default(), State::default()];
    for substep in &case.plan.substeps {
        fused.explicit_substep(substep)?;
        stepper::explicit::substep(&mut *staged, substep)?;
        fused.state_read(&mut fused_state)?;
        staged.state_read(&mut staged_state)?;
        let difference = first_difference(&fused_state, &staged_state);
        ensure(difference.is_none(), || {
            let i = difference.unwrap_or_default();
            format!(
                "{}: particle {i} differs after substep {}: fused {:?}, staged {:?}",
                candidate.label,
                substep.index,
                (fused_state.positions[i], fused_state.velocities[i]),
                (staged_state.positions[i], staged_state.velocities[i]),
            )
        })?;
    }
    Ok(())
}
