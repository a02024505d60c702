//! Symplectic Euler with strain limiting (NUMERICS §4).

use crate::{Kernels, Result};

use super::{Substep, finish, forces};

/// One explicit substep, stage by stage: forces at the present state, integration, contact between
/// cloths, strain limiting, and colliders last, so that no particle ends inside one.
///
/// # Errors
/// Those of the stages.
pub fn substep<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    let contact = kernels.model().self_contact().is_some();
    let penalty = kernels.contact_is_penalty();
    finish::collider_start(kernels)?;
    kernels.field_forces()?;
    if kernels.model().has_procedural_fields() {
        kernels.procedural_forces(substep)?;
    }
    kernels.spring_forces()?;
    forces::fabric(kernels)?;
    if kernels.model().air().is_some() {
        kernels.aerodynamic_forces(substep)?;
    }
    if contact && penalty {
        kernels.contact_candidates()?;
        kernels.contact_forces()?;
    }
    kernels.integrate_explicit(substep)?;
    after_integration(kernels, substep)?;
    if !kernels.model().colliders().is_empty() {
        kernels.collider_response(substep)?;
    }
    Ok(())
}

/// The stages between integration and colliders: impulses of contact, strain limiting. A fused
/// substep of a backend calls this too when the scene needs it.
///
/// # Errors
/// Those of the stages.
pub fn after_integration<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    if kernels.model().self_contact().is_some() && !kernels.contact_is_penalty() {
        kernels.contact_candidates()?;
        kernels.contact_impulses(substep)?;
    }
    finish::strain_limit(kernels, substep)
}

/// Whether [`after_integration`] does anything for this model and these settings.
#[must_use]
pub fn has_work_after_integration<K: Kernels + ?Sized>(kernels: &K) -> bool {
    let impulses = kernels.model().self_contact().is_some() && !kernels.contact_is_penalty();
    impulses || kernels.strain_limit_colours() > 0
}
