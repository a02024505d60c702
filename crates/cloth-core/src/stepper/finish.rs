//! How a large substep ends: motion, contact between cloths, strain limiting, colliders.

use crate::{Kernels, Result, SelfContact};

use super::Substep;

/// Moves the particles with the velocity that the step has found. Where contact acts by impulses
/// the way is divided, so that two cloths cannot pass through each other between two looks.
///
/// # Errors
/// Those of the stages.
pub(super) fn advance<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    if kernels.contact_is_impulse() {
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
    kernels.strain_limit_sweeps(substep)?;
    colliders_and_certificate(kernels, substep)
}

/// What comes last in a substep: colliders, then the proof that no triangles meet. Nothing may move particles after it.
///
/// # Errors
/// Those of the stages.
pub fn colliders_and_certificate<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
) -> Result<()> {
    if !kernels.model().colliders().is_empty() {
        kernels.collider_response(substep)?;
    }
    if kernels.model().has_triangle_contact() {
        kernels.contact_certify(substep)?;
    }
    Ok(())
}

/// Notes where a substep starts, for colliders that something could pass, all but half spaces, and for contact of triangles.
///
/// # Errors
/// Those of the stages.
pub fn collider_start<K: Kernels + ?Sized>(kernels: &mut K) -> Result<()> {
    let model = kernels.model();
    if model.has_passable_colliders() || model.has_triangle_contact() {
        kernels.start_keep()
    } else {
        Ok(())
    }
}

/// All sweeps of the strain limit, of springs and then of triangles, stage by stage.
///
/// # Errors
/// Those of the stages.
pub fn strain_limit_sweeps<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    let sweeps = kernels.config().strain_limit.as_ref().map_or(0, |limit| limit.sweeps);
    for _ in 0..sweeps {
        for colour in 0..kernels.strain_limit_colours() {
            kernels.strain_limit(substep, colour)?;
        }
        for colour in 0..kernels.stretch_limit_colours() {
            kernels.stretch_limit(substep, colour)?;
        }
    }
    Ok(())
}
