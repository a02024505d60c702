//! A fabric as a laboratory reports it.

use std::fmt;

use super::{
    BendingRigidity, Fabric, FabricError, InternalFriction, TensileCurve, TensileFit,
    TensileSample,
    units::{GF_PER_CM, GRAVITY},
};
use crate::{ModelError, error::in_range};

/// What a laboratory measured of one fabric, in SI units; [`units`](super::units) has those of its instruments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FabricSheet {
    /// Mass per area \[kg/m^2\].
    pub area_density: f64,
    /// Thickness \[m\].
    pub thickness: Option<f64>,
    /// Tension along the warp and the weft.
    pub tensile: [Option<TensileSheet>; 2],
    /// Biaxial coupling \[N/m\].
    pub coupling: Option<f64>,
    /// Shear stiffness G \[N/m\], for an angle in radians.
    pub shear: Option<f64>,
    /// Hysteresis in shear at small angles, 2HG \[N/m\].
    pub shear_hysteresis: Option<f64>,
    /// Bending of strips cut along the warp, along the weft, and at 45 degrees.
    pub bending: [Option<BendingSheet>; 3],
    /// Hysteresis in bending along the warp and the weft, 2HB \[N\].
    pub bending_hysteresis: [Option<f64>; 2],
}

/// Tension along one thread.
#[derive(Clone, Debug, PartialEq)]
pub enum TensileSheet {
    /// KES-FB1, strip biaxial to 500 gf/cm.
    Kawabata {
        /// LT, linearity, dimensionless.
        linearity: f64,
        /// WT, work \[J/m^2\].
        work: Option<f64>,
        /// EMT, strain at the largest force, dimensionless; without it the one that LT and WT say.
        extension: Option<f64>,
    },
    /// A measured curve.
    Curve(Vec<TensileSample>),
    /// The strain at one force per width \[N/m\], as FAST-2 gives it: a straight line.
    Extension {
        /// Strain, dimensionless.
        strain: f64,
        /// Force per width \[N/m\].
        force: f64,
    },
    /// Slope at rest \[N/m\].
    Slope(f64),
}

/// Bending of a strip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BendingSheet {
    /// Rigidity per width \[N m\]: KES-FB2, FAST-2.
    Rigidity(f64),
    /// Length that hangs over the edge when its end is 41.5 degrees down \[m\] (ASTM D1388, option A; Peirce 1930).
    Overhang(f64),
}

/// How a sheet became a fabric.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FitReport {
    /// The fits of warp and weft, where a curve was fitted.
    pub tension: [Option<TensileFit>; 2],
    /// What was not measured and what stands for it.
    pub assumed: Vec<String>,
    /// What does not agree within the sheet.
    pub notes: Vec<String>,
}

/// Largest force of KES-FB1, 500 gf/cm \[N/m\].
const KAWABATA_FORCE: f64 = 500.0 * GF_PER_CM;

/// Points of a curve that is given by its linearity.
const KAWABATA_POINTS: u32 = 64;

/// Slope that stands for a tension that was not measured \[N/m\]: stiff enough that a hanging cloth hardly stretches, which is
/// what one sees of cloth of which only the bending was measured.
const ASSUMED_SLOPE: f64 = 1000.0;

/// Shear stiffness that stands for one that was not measured \[N/m\], about 0.7 gf/(cm degree): of the order of light wovens.
const ASSUMED_SHEAR: f64 = 40.0;

/// Mass per volume that gives the thickness where it was not measured \[kg/m^3\]: threads and the air between them.
const ASSUMED_DENSITY: f64 = 500.0;

impl FabricSheet {
    /// The fabric that this sheet describes, and how well. `owner` is whose sheet it is, for errors.
    ///
    /// # Errors
    /// Numbers outside what cloth can have, which are hardly in the right units; curves that cannot be fitted; whatever
    /// [`Fabric::validate`] finds.
    pub fn fit(&self, owner: &str) -> Result<(Fabric, FitReport), FabricError> {
        let mut report = FitReport::default();
        range(owner, "mass per area [kg/m^2]", self.area_density, [1e-3, 10.0])?;
        let thickness = self.thickness.unwrap_or_else(|| {
            let thickness = self.area_density / ASSUMED_DENSITY;
            report.assumed.push(format!(
                "thickness {:.2e} m, from the mass at {ASSUMED_DENSITY} kg/m^3",
                thickness
            ));
            thickness
        });
        range(owner, "thickness [m]", thickness, [1e-6, 0.1])?;
        let warp = self.tension(0, owner, &mut report)?;
        let weft = self.tension(1, owner, &mut report)?;
        let shear = self.shear.unwrap_or_else(|| {
            report.assumed.push(format!("shear stiffness {ASSUMED_SHEAR} N/m"));
            ASSUMED_SHEAR
        });
        range(owner, "shear stiffness G [N/m]", shear, [1e-2, 1e5])?;
        let coupling = self.coupling.unwrap_or_else(|| {
            report.assumed.push("no biaxial coupling".to_owned());
            0.0
        });
        let fabric = Fabric {
            area_density: self.area_density,
            thickness,
            warp,
            weft,
            coupling,
            shear,
            bending: self.rigidity(owner, &mut report)?,
            friction: self.friction(owner, &mut report)?,
            damping: [0.0; 2],
            stretch_limit: f64::INFINITY,
        }
        .with_usual_stretch_limit();
        report.assumed.push(format!("largest stretch {:.2}", fabric.stretch_limit));
        fabric.validate(owner)?;
        Ok((fabric, report))
    }

    fn tension(
        &self,
        thread: usize,
        owner: &str,
        report: &mut FitReport,
    ) -> Result<TensileCurve, FabricError> {
        let name = ["warp", "weft"][thread];
        let whose = format!("the {name} of {owner}");
        let fit = match &self.tensile[thread] {
            None => {
                report.assumed.push(format!("slope of {name} {ASSUMED_SLOPE} N/m"));
                return Ok(TensileCurve::linear(ASSUMED_SLOPE));
            }
            Some(TensileSheet::Slope(slope)) => {
                range(&whose, "slope at rest [N/m]", *slope, [1e-2, 1e8])?;
                return Ok(TensileCurve::linear(*slope));
            }
            Some(TensileSheet::Extension { strain, force }) => {
                range(&whose, "extension", *strain, [1e-5, 5.0])?;
                range(&whose, "force per width [N/m]", *force, [1e-2, 1e5])?;
                let point =
                    |part: f64| TensileSample { strain: part * strain, force: part * force };
                TensileFit::new(&[point(0.5), point(1.0)], &whose)?
            }
            Some(TensileSheet::Curve(samples)) => TensileFit::new(samples, &whose)?,
            Some(TensileSheet::Kawabata { linearity, work, extension }) => {
                let samples = kawabata(*linearity, *work, *extension, &whose, report)?;
                TensileFit::new(&samples, &whose)?
            }
        };
        report.tension[thread] = Some(fit);
        Ok(fit.curve)
    }

    fn rigidity(
        &self,
        owner: &str,
        report: &mut FitReport,
    ) -> Result<BendingRigidity, FabricError> {
        let mut measured = [None; 3];
        let directions = ["along the warp", "along the weft", "at 45 degrees"];
        for ((value, sheet), direction) in measured.iter_mut().zip(self.bending).zip(directions) {
            let Some(sheet) = sheet else { continue };
            let rigidity = match sheet {
                BendingSheet::Rigidity(rigidity) => rigidity,
                BendingSheet::Overhang(length) => {
                    range(owner, "overhang [m]", length, [2e-3, 1.0])?;
                    overhang_rigidity(self.area_density, length)
                }
            };
            let what = format!("bending rigidity {direction} [N m]");
            *value = Some(range(owner, &what, rigidity, [1e-9, 1e-1])?);
        }
        let [warp, weft, bias] = measured;
        let (warp, weft) = match (warp, weft) {
            (Some(warp), Some(weft)) => (warp, weft),
            (Some(one), None) | (None, Some(one)) => {
                report.assumed.push("the same bending rigidity along warp and weft".to_owned());
                (one, one)
            }
            (None, None) => {
                let problem = "bending rigidity along warp or weft".to_owned();
                return Err(ModelError::NotPositive {
                    what: format!("{problem} of {owner}, which is not given and"),
                    value: 0.0,
                }
                .into());
            }
        };
        if bias.is_none() {
            report.assumed.push("bending at 45 degrees from warp and weft".to_owned());
        }
        Ok(BendingRigidity { warp, weft, bias })
    }

    fn friction(
        &self,
        owner: &str,
        report: &mut FitReport,
    ) -> Result<InternalFriction, FabricError> {
        let shear = self.shear_hysteresis.unwrap_or(0.0);
        range(owner, "hysteresis in shear 2HG [N/m]", shear, [0.0, 1e4])?;
        let measured: Vec<f64> = self.bending_hysteresis.into_iter().flatten().collect();
        for &value in &measured {
            range(owner, "hysteresis in bending 2HB [N]", value, [0.0, 1.0])?;
        }
        // Not `sum`, which gives -0 for nothing.
        let bending = measured.iter().fold(0.0, |sum, x| sum + x) / measured.len().max(1) as f64;
        if self.shear_hysteresis.is_none() || measured.is_empty() {
            report.assumed.push("no friction between threads where no hysteresis is given".into());
        }
        Ok(InternalFriction { shear: 0.5 * shear, bending: 0.5 * bending })
    }
}

/// Rigidity of a strip that hangs down by 41.5 degrees when it is this long \[m\]: B = rho g (length / 2)^3 \[N m\] (Peirce 1930;
/// ASTM D1388, option A).
#[must_use]
pub fn overhang_rigidity(area_density: f64, length: f64) -> f64 {
    area_density * GRAVITY * (0.5 * length).powi(3)
}

/// The curve F = F_m (q s + (1 - q) s^3), s = strain / EMT, q = 2 LT - 1, whose work is WT = LT F_m EMT / 2.
fn kawabata(
    linearity: f64,
    work: Option<f64>,
    extension: Option<f64>,
    whose: &str,
    report: &mut FitReport,
) -> Result<Vec<TensileSample>, FabricError> {
    range(whose, "LT", linearity, [0.1, 1.5])?;
    if let Some(work) = work {
        range(whose, "WT [J/m^2]", work, [1e-2, 1e3])?;
    }
    let by_work = work.map(|work| 2.0 * work / (linearity * KAWABATA_FORCE));
    let Some(extension) = extension.or(by_work) else {
        return Err(FabricError::TensileCurve {
            owner: whose.into(),
            problem: "LT alone says no strain: give EMT or WT".into(),
        });
    };
    range(whose, "EMT", extension, [1e-3, 3.0])?;
    if let Some(other) = by_work.filter(|other| (other / extension - 1.0).abs() > 0.1) {
        report.notes.push(format!(
            "{whose}: EMT is {:.1} %, but LT and WT say {:.1} %; EMT is taken",
            100.0 * extension,
            100.0 * other
        ));
    }
    let share = (2.0 * linearity - 1.0).clamp(0.05, 1.0);
    if share != 2.0 * linearity - 1.0 {
        report.notes.push(format!(
            "{whose}: LT {linearity} is outside of 0.525 to 1, and the nearest is taken"
        ));
    }
    let sample = |i: u32| {
        let s = f64::from(i) / f64::from(KAWABATA_POINTS);
        let force = KAWABATA_FORCE * (share * s + (1.0 - share) * s * s * s);
        TensileSample { strain: extension * s, force }
    };
    Ok((0..=KAWABATA_POINTS).map(sample).collect())
}

fn range(owner: &str, what: &str, value: f64, bounds: [f64; 2]) -> Result<f64, FabricError> {
    Ok(in_range(|| format!("{what} of {owner}"), value, bounds)?)
}

impl fmt::Display for FitReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, fit) in ["warp", "weft"].into_iter().zip(self.tension) {
            let Some(fit) = fit else { continue };
            let TensileCurve { linear, cubic, end } = fit.curve;
            writeln!(
                formatter,
                "{name}: {linear:.1} N/m E + {cubic:.4e} N/m E^3 to E = {end:.4}; off by {:.1} % of the largest force on average, {:.1} % \
                 at most; work {:.2} J/m^2 of {:.2}",
                100.0 * fit.mean_deviation,
                100.0 * fit.largest_deviation,
                fit.work[1],
                fit.work[0]
            )?;
        }
        for note in &self.notes {
            writeln!(formatter, "note: {note}")?;
        }
        for assumed in &self.assumed {
            writeln!(formatter, "assumed: {assumed}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::units::{GF_CM_PER_CM2, GF_CM2_PER_CM, GF_PER_CM_DEGREE},
        *,
    };

    fn suiting() -> FabricSheet {
        let tensile =
            Some(TensileSheet::Kawabata { linearity: 0.65, work: None, extension: Some(0.06) });
        FabricSheet {
            area_density: 0.2,
            thickness: Some(0.5e-3),
            tensile: [tensile.clone(), tensile],
            coupling: None,
            shear: Some(0.8 * GF_PER_CM_DEGREE),
            shear_hysteresis: Some(1.0 * GF_PER_CM),
            bending: [
                Some(BendingSheet::Rigidity(0.1 * GF_CM2_PER_CM)),
                Some(BendingSheet::Overhang(0.04)),
                None,
            ],
            bending_hysteresis: [Some(4e-4), Some(2e-4)],
        }
    }

    #[test]
    fn a_kawabata_sheet_becomes_a_fabric() {
        let (fabric, report) = suiting().fit("suiting").unwrap();
        let fit = report.tension[0].unwrap();
        // WT = LT F_m EMT / 2, whatever the fit.
        assert!((fit.work[0] / (0.5 * 0.65 * KAWABATA_FORCE * 0.06) - 1.0).abs() < 1e-3);
        assert!(fit.largest_deviation < 0.03 && (fit.work[1] / fit.work[0] - 1.0).abs() < 0.02);
        // The slope at rest is q F_m / EMT but for what the fit moves.
        let slope = 0.3 * KAWABATA_FORCE / 0.06;
        assert!((fabric.warp.linear / slope - 1.0).abs() < 0.1, "{}", fabric.warp.linear);
        assert!((fabric.shear - 44.95).abs() < 0.01);
        assert!((fabric.bending.warp - 9.807e-6).abs() < 1e-9);
        assert!((fabric.bending.weft - 0.2 * 9.806_65 * 8e-6).abs() < 1e-12);
        assert!((fabric.friction.shear - 0.490_3).abs() < 1e-3);
        assert!((fabric.friction.bending - 1.5e-4).abs() < 1e-12);
        assert!(report.to_string().contains("assumed: no biaxial coupling"), "{report}");
    }

    #[test]
    fn work_gives_the_extension_and_is_compared_with_it() {
        let mut sheet = suiting();
        let work = 10.0 * GF_CM_PER_CM2;
        let kawabata =
            |work, extension| Some(TensileSheet::Kawabata { linearity: 0.65, work, extension });
        sheet.tensile[0] = kawabata(Some(work), None);
        let (_, report) = sheet.fit("suiting").unwrap();
        assert!((report.tension[0].unwrap().work[0] / work - 1.0).abs() < 1e-3);
        sheet.tensile[0] = kawabata(Some(work), Some(0.12));
        let (_, report) = sheet.fit("suiting").unwrap();
        assert!(report.notes[0].contains("EMT is 12.0 %, but LT and WT say 6.2 %"), "{report}");
        sheet.tensile[0] = kawabata(None, None);
        assert!(sheet.fit("suiting").unwrap_err().to_string().contains("give EMT or WT"));
    }

    #[test]
    fn numbers_in_other_units_are_refused() {
        let refused = |change: &dyn Fn(&mut FabricSheet), words: &str| {
            let mut sheet = suiting();
            change(&mut sheet);
            let message = sheet.fit("suiting").unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        };
        refused(&|s| s.area_density = 200.0, "mass per area [kg/m^2] of suiting is 200");
        refused(&|s| s.thickness = Some(0.5), "thickness [m]");
        refused(&|s| s.bending[0] = Some(BendingSheet::Rigidity(0.2)), "bending rigidity");
        refused(&|s| s.bending[1] = Some(BendingSheet::Overhang(4.0)), "overhang [m]");
        refused(&|s| s.bending = [None; 3], "not given");
        let kawabata = |linearity, extension| TensileSheet::Kawabata {
            linearity,
            work: None,
            extension: Some(extension),
        };
        refused(&|s| s.tensile[1] = Some(kawabata(65.0, 0.06)), "LT of the weft of suiting is 65");
        refused(&|s| s.tensile[0] = Some(kawabata(0.65, 6.0)), "EMT of the warp of suiting is 6");
    }

    #[test]
    fn overhangs_alone_are_enough() {
        let sheet = FabricSheet {
            area_density: 0.15,
            bending: [Some(BendingSheet::Overhang(0.05)), None, None],
            ..FabricSheet::default()
        };
        let (fabric, report) = sheet.fit("strip").unwrap();
        assert_eq!(fabric.bending.warp, fabric.bending.weft);
        assert_eq!(report.assumed.len(), 9, "{report}");
    }
}
