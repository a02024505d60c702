//! Rows of Feng et al. (2022).

use cloth_core::fabric::FabricSheet;
use serde::Deserialize;

use super::rigidity;

/// One row: mass per area \[kg/m^2\], and the moment over curvature along warp, weft and 45 degrees.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Feng {
    area_density: f64,
    /// \[1e-9 N m\]
    linear: [f64; 3],
    /// \[1e-12 N m^2\]; kept with the source's numbers, the law has no place for it.
    #[serde(rename = "nonlinear")]
    _nonlinear: [f64; 3],
}

impl Feng {
    pub(super) fn sheet(&self) -> FabricSheet {
        FabricSheet {
            area_density: self.area_density,
            bending: self.linear.map(|value| rigidity(1e-9 * value)),
            ..FabricSheet::default()
        }
    }
}
