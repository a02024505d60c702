//! Tables of Wang, O'Brien and Ramamoorthi (2011); `fabrics.toml` says how they are read.

use cloth_core::fabric::{
    BendingSheet, Fabric, FabricError, FabricSheet, FitReport, TensileSample, TensileSheet,
};
use serde::Deserialize;

use super::rigidity;

/// The table of one fabric.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wang {
    /// \[kg/m^2\]
    area_density: f64,
    /// Rows of c11, c12, c22, c33 \[N/m\]: at rest, then stretched along 0, 22.5, 45, 67.5 and 90 degrees to u.
    stretching: [[f64; 4]; 6],
    /// k_e \[1e-6 N m\] of edges at 0, 45 and 90 degrees to u, over curvature.
    bending: [[f64; 5]; 3],
}

/// Elongation of the rows that are stretched.
const STRETCHED: f64 = 1.0 / 6.0;

/// Points of a tensile curve.
const POINTS: u32 = 32;

impl Wang {
    pub(super) fn fit(&self, name: &str) -> Result<(Fabric, FitReport), FabricError> {
        let [rest, along_u, .., along_v] = self.stretching;
        let curve = |at_rest: f64, stretched: f64| {
            let sample = |i: u32| {
                let strain = STRETCHED * f64::from(i) / f64::from(POINTS);
                let modulus = 2.0 * (at_rest + (stretched - at_rest) * strain / STRETCHED);
                let green = strain + 0.5 * strain * strain;
                TensileSample { strain, force: modulus * green * (1.0 + strain) }
            };
            Some(TensileSheet::Curve((0..=POINTS).map(sample).collect()))
        };
        let bending: [Option<BendingSheet>; 3] =
            [0, 2, 1].map(|row| rigidity(0.25e-6 * self.bending[row][0]));
        let sheet = FabricSheet {
            area_density: self.area_density,
            tensile: [curve(rest[2], along_v[2]), curve(rest[0], along_u[0])],
            coupling: Some(2.0 * rest[1]),
            shear: Some(rest[3]),
            bending,
            ..FabricSheet::default()
        };
        let (fabric, mut report) = sheet.fit(name)?;
        for (thread, fitted, measured) in
            [("warp", fabric.warp, 2.0 * rest[2]), ("weft", fabric.weft, 2.0 * rest[0])]
        {
            if (fitted.linear / measured - 1.0).abs() > 0.5 {
                report.notes.push(format!(
                    "the slope of the {thread} at rest is {measured:.1} N/m in the table and {:.1} N/m in the fit, which is least off over the whole \
                     curve",
                    fitted.linear
                ));
            }
        }
        Ok((fabric, report))
    }
}
