//! Signed distances of any solid, sampled on a regular grid.

use crate::{
    ModelError, TriangleMesh,
    error::{finite_all, positive},
};

/// Signed distances \[m\] at the points of a regular grid, negative inside; between them
/// trilinear interpolation, outside the grid the nearest point of it (NUMERICS §7).
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceGrid {
    /// Place of the first sample in the local frame \[m\].
    pub origin: [f64; 3],
    /// Distance of neighbouring samples \[m\].
    pub spacing: f64,
    /// Samples along each axis, at least 2.
    pub size: [u32; 3],
    /// The samples; that at (i, j, k) has index (k size\[1\] + j) size\[0\] + i.
    pub distances: Vec<f32>,
    /// The surface that was sampled, for pictures.
    pub surface: TriangleMesh,
}

impl DistanceGrid {
    /// Most samples of a grid.
    pub const SAMPLES_MAX: u64 = 1 << 27;

    pub(super) fn validate(&self, name: &str) -> Result<(), ModelError> {
        finite_all(|| format!("origin of the distances of collider {name:?}"), &self.origin)?;
        positive(|| format!("spacing of the distances of collider {name:?}"), self.spacing)?;
        let count: u64 = self.size.iter().map(|&side| u64::from(side)).product();
        if self.size.iter().any(|&side| side < 2) || count != self.distances.len() as u64 {
            return Err(ModelError::LengthMismatch {
                what: "the distances of a collider",
                found: self.distances.len(),
                expected: usize::try_from(count).unwrap_or(usize::MAX),
            });
        }
        match self.distances.iter().find(|distance| !distance.is_finite()) {
            Some(&value) => Err(ModelError::NonFinite {
                what: format!("a distance of collider {name:?}"),
                value: value.into(),
            }),
            None => Ok(()),
        }
    }
}
