//! The numbers of the constant matrix W.

use cloth_core::{Error, FabricMatrix, Model, ModelError, Result};

use crate::sparse_cholesky::LowerPattern;

/// The least mass of a particle, as a share of the sum of its springs and triangles in W: what is smaller would be
/// lost in the rounding of the factorisation.
const MASS_SHARE_MIN: f64 = 1e-12;

/// Writes W for substeps of `length` \[s\] in the order of its pattern: for each particle the diagonal
/// entry, then those of later particles. Rows and columns of held particles are those of the
/// unit matrix, so that the pattern stays.
///
/// # Errors
/// `Invalid` if a number overflows.
pub(super) fn fill(
    model: &Model,
    fabric: Option<&FabricMatrix>,
    pattern: &LowerPattern,
    held: &[bool],
    length: f64,
    values: &mut Vec<f64>,
) -> Result<()> {
    let springs = model.springs();
    values.clear();
    values.resize(pattern.rows.len(), 0.0);
    for (i, &held_i) in held.iter().enumerate() {
        for spring in springs.row(i) {
            let j = springs.columns()[spring] as usize;
            let kind = &springs.kinds()[springs.kind_indices()[spring] as usize];
            let weight = length * length * kind.stiffness + length * kind.damping;
            values[pattern.offsets[i]] += weight;
            values[pattern.offsets[j]] += weight;
            if !(held_i || held[j]) {
                values[pattern.place(i, j)] -= weight;
            }
        }
    }
    if let Some(fabric) = fabric {
        for (i, own) in fabric.own().iter().enumerate() {
            values[pattern.offsets[i]] += own.weight(length);
            let entries = &fabric.entries()[fabric.row(i)];
            for (&j, entry) in fabric.neighbours().row(i).iter().zip(entries) {
                let j = j as usize;
                if j > i && !(held[i] || held[j]) {
                    values[pattern.place(i, j)] += entry.weight(length);
                }
            }
        }
    }
    for (particle, &held) in held.iter().enumerate() {
        let diagonal = &mut values[pattern.offsets[particle]];
        let mass = model.masses()[particle].max(MASS_SHARE_MIN * *diagonal);
        *diagonal = if held { 1.0 } else { mass + *diagonal };
    }
    match values.iter().find(|value| !value.is_finite()) {
        Some(&value) => Err(Error::Invalid(ModelError::NonFinite {
            what: format!("an entry of the constant matrix for a substep of {length} s"),
            value,
        })),
        None => Ok(()),
    }
}
