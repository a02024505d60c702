//! How a large substep ends: motion, contact between cloths, strain limiting, colliders.

use crate::{Kernels, Result, SelfContact};

use super::Substep;

/// Moves the particles with the velocity that the step has found. Where contact acts by impulses
/// the way is divided, so that two cloths cannot pass through each other between two looks.
///
/// # Errors
/// Those of the stages.
pub(super) fn advance<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    let impulses = kernels.model().self_contact().is_some() && !kernels.contact_is_penalty();
    if impulses {
        let moves = SelfContact::moves(substep.length);
        let part = substep.length / f64::from(moves);
        let length = SelfContact::recovery_length(part, substep.length);
        let recovery = Substep { length, ..*substep };
        for _ in 0..moves {
            kernels.position_advance(part)?;
            kernels.contact_candidates()?;
            kernels.contact_impulses(&recovery)?;
        }
    } else {
        kernels.position_advance(substep.length)?;
    }
    strain_limit(kernels, substep)?;
    if !kernels.model().colliders().is_empty() {
        kernels.collider_response(substep)?;
    }
    Ok(())
}

/// Notes where a substep starts, for colliders that something could pass: all but half spaces.
///
/// # Errors
/// Those of the stages.
pub fn collider_start<K: Kernels + ?Sized>(kernels: &mut K) -> Result<()> {
    if kernels.model().has_passable_colliders() { kernels.start_keep() } else { Ok(()) }
}

/// All sweeps of the strain limit.
///
/// # Errors
/// Those of the stages.
pub(super) fn strain_limit<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    let sweeps = kernels.config().strain_limit.as_ref().map_or(0, |limit| limit.sweeps);
    for _ in 0..sweeps {
        for colour in 0..kernels.strain_limit_colours() {
            kernels.strain_limit(substep, colour)?;
        }
    }
    Ok(())
}
