//! Forces that the implicit integrators have in common.

use crate::{Kernels, NewtonStart, Result};

use super::Substep;

/// Adds the forces of fabric to f, where there is any.
///
/// # Errors
/// Those of the stages.
pub(super) fn fabric<K: Kernels + ?Sized>(kernels: &mut K) -> Result<()> {
    if kernels.model().has_fabric() {
        kernels.membrane_forces()?;
        kernels.bending_forces()?;
    }
    Ok(())
}

/// Sets f to the forces of fields and air.
///
/// # Errors
/// Those of the stages.
pub(super) fn external<K: Kernels + ?Sized>(kernels: &mut K, substep: &Substep) -> Result<()> {
    kernels.field_forces()?;
    if kernels.model().has_procedural_fields() {
        kernels.procedural_forces(substep)?;
    }
    if kernels.model().air().is_some() {
        kernels.aerodynamic_forces(substep)?;
    }
    Ok(())
}

/// Finds contacts that act through forces, and adds these to f, where there are any.
///
/// # Errors
/// Those of the stages.
pub(super) fn contact<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    start: NewtonStart,
) -> Result<()> {
    contact_find(kernels, substep, start)?;
    if kernels.contact_is_penalty() || kernels.model().has_triangle_contact() {
        kernels.contact_forces()?;
    }
    Ok(())
}

/// Finds contacts that act through forces.
///
/// # Errors
/// Those of the stages.
pub fn contact_find<K: Kernels + ?Sized>(
    kernels: &mut K,
    substep: &Substep,
    start: NewtonStart,
) -> Result<()> {
    if kernels.contact_is_penalty() {
        kernels.contact_candidates()?;
    } else if kernels.model().has_triangle_contact() {
        kernels.contact_pairs(substep)?;
        kernels.contact_geometry(substep, start)?;
    }
    Ok(())
}
