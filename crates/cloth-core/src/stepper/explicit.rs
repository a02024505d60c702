//! Symplectic Euler with strain limiting (NUMERICS §4).

use crate::{Kernels, NewtonStart, Result};

use super::{Substep, finish, forces};

/// One explicit substep, stage by stage: forces at the present state, integration, contact between
/// cloths, strain limiting, and colliders, so that no particle ends inside one; then the proof that no triangles meet, which may
/// shorten ways.
///
/// # Errors
/// Those of the stages.
pub fn substep<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
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
    forces::contact(kernels, substep, NewtonStart::StepStart)?;
    kernels.integrate_explicit(substep)?;
    after_integration(kernels, substep)?;
    finish::colliders_and_certificate(kernels, substep)
}

/// The stages between integration and colliders: impulses of contact, strain limiting. A fused
/// substep of a backend calls this too when the scene needs it.
///
/// # Errors
/// Those of the stages.
pub fn after_integration<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    if kernels.contact_is_impulse() {
        kernels.contact_candidates()?;
        kernels.contact_impulses(substep)?;
    }
    kernels.strain_limit_sweeps(substep)
}

/// Whether [`after_integration`] does anything for this model and these settings, or contact of triangles is to be certified at
/// the end.
#[must_use]
pub fn has_work_after_integration<K: Kernels + ?Sized>(kernels: &K) -> bool {
    kernels.contact_is_impulse()
        || kernels.model().has_triangle_contact()
        || kernels.strain_limit_colours() > 0
        || kernels.stretch_limit_colours() > 0
}
