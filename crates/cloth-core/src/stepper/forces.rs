//! Forces that the implicit integrators have in common.

use crate::{Kernels, Result};

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
