//! NUMERICS §6, `semi_implicit_factorise`.

use cloth_core::{
    Divergence, DivergenceCause, DivergenceOrigin, Error, FabricMatrix, Model, ModelError, Result,
};

use crate::{Particles, sparse_cholesky::SparseCholesky};

/// Factorisations that are kept: one for the length of substeps, one for the shorter last substep of a frame.
const KEPT: usize = 2;

/// Lengths that differ by less than this share of them differ by rounding.
const SAME_LENGTH: f64 = 1e-9;

/// The least mass of a particle, as a share of the sum of its springs and triangles in W.
const MASS_SHARE_MIN: f64 = 1e-12;

/// W, factorised for the last few lengths of substeps, the one used last first, and the particles that it was made for.
#[derive(Default)]
pub(crate) struct Factorisations {
    kept: Vec<(f64, SparseCholesky)>,
    held: Vec<bool>,
}

impl Factorisations {
    /// The one in use.
    pub(crate) fn present(&self) -> Option<&SparseCholesky> {
        self.kept.first().map(|(_, factors)| factors)
    }
}

/// Makes sure that W is factorised for this length and the particles held now. Returns whether that had to be done.
///
/// # Errors
/// `Invalid` if a number of W overflows, `Diverged` if it cannot be factorised.
pub(crate) fn semi_implicit_factorise(
    model: &Model,
    particles: &Particles<f64>,
    length: f64,
    factorisations: &mut Factorisations,
) -> Result<bool> {
    let held: Vec<bool> = (0..particles.len()).map(|i| particles.is_held(i)).collect();
    if held != factorisations.held {
        *factorisations = Factorisations { kept: Vec::new(), held };
    }
    let Factorisations { kept, held } = factorisations;
    let is_same = |(known, _): &(f64, _)| (known - length).abs() <= SAME_LENGTH * length;
    if let Some(place) = kept.iter().position(is_same) {
        kept[..=place].rotate_right(1);
        return Ok(false);
    }
    let entries = constant_matrix(model, held, length);
    if let Some(&(_, _, value)) = entries.iter().find(|entry| !entry.2.is_finite()) {
        let what = format!("an entry of the constant matrix for a substep of {length} s");
        return Err(Error::Invalid(ModelError::NonFinite { what, value }));
    }
    let Some(factors) = SparseCholesky::new(held.len(), &entries) else {
        return Err(Error::Diverged(Divergence {
            step: 0,
            time: 0.0,
            particle: 0,
            cause: DivergenceCause::LinearSolver,
            time_step: length,
            stable_time_step: None,
            origin: DivergenceOrigin::Unknown,
        }));
    };
    kept.truncate(KEPT - 1);
    kept.insert(0, (length, factors));
    Ok(true)
}

/// The lower triangle of W, with the rows and columns of the unit matrix for held particles.
fn constant_matrix(model: &Model, held: &[bool], length: f64) -> Vec<(usize, usize, f64)> {
    let mut diagonal = vec![0.0; held.len()];
    let mut entries = Vec::new();
    for spring in model.springs().iter() {
        let kind = model.springs().kinds()[spring.kind as usize];
        let weight = length * length * kind.stiffness + length * kind.damping;
        let [i, j] = spring.particles.map(|particle| particle as usize);
        diagonal[i] += weight;
        diagonal[j] += weight;
        if !(held[i] || held[j]) {
            entries.push((j, i, -weight));
        }
    }
    if model.has_fabric() {
        let fabric = FabricMatrix::constant(model);
        for i in 0..held.len() {
            diagonal[i] += fabric.own()[i].weight(length);
            for (&j, entry) in
                fabric.neighbours().row(i).iter().zip(&fabric.entries()[fabric.row(i)])
            {
                let j = j as usize;
                if j > i && !(held[i] || held[j]) {
                    entries.push((j, i, entry.weight(length)));
                }
            }
        }
    }
    for (i, springs) in diagonal.into_iter().enumerate() {
        let mass = model.masses()[i].max(MASS_SHARE_MIN * springs);
        entries.push((i, i, if held[i] { 1.0 } else { mass + springs }));
    }
    entries
}
