//! What a cloth is made of, as the elements need it.

use super::{FabricError, InternalFriction};
use crate::error::{finite, not_negative, positive};

/// Largest part of psi_u'' psi_v'' that the square of the coupling may be (NUMERICS §11).
pub const COUPLING_SHARE: f64 = 0.95;

/// Share of (B1 B2)^1/2 that the twisting term of the rigidity has at least, so that no bent shape is free.
const TWIST_SHARE: f64 = 0.1;

/// Mechanical properties of one cloth of triangles, in SI units. u is the warp, v the weft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Mass per area \[kg/m^2\].
    pub area_density: f64,
    /// Thickness \[m\].
    pub thickness: f64,
    /// Stress along the warp while the weft keeps its length (strip biaxial).
    pub warp: TensileCurve,
    /// Stress along the weft while the warp keeps its length.
    pub weft: TensileCurve,
    /// Biaxial coupling c: stress along one thread for strain along the other \[N/m\].
    pub coupling: f64,
    /// Shear stiffness G: force per width for an angle between the threads \[N/m\].
    pub shear: f64,
    /// Resistance against bending.
    pub bending: BendingRigidity,
    /// Friction between the threads, which makes the hysteresis of the measured curves.
    pub friction: InternalFriction,
    /// Rayleigh damping: viscous stress per elastic stiffness and rate of strain \[s\], for stretching and bending.
    pub damping: [f64; 2],
}

/// Second Piola stress over Green strain E along a thread (NUMERICS §11): linear + cubic E^3 up to the strain at which the measured
/// curve ends, a straight line with the slope there beyond it, and one with the slope at rest under compression.
///
/// The straight line keeps the slope, and with it the stable time step, bounded where nothing was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensileCurve {
    /// Slope at rest \[N/m\], positive.
    pub linear: f64,
    /// Coefficient of E^3 \[N/m\], not negative, so that the slope never falls.
    pub cubic: f64,
    /// Green strain at which the curve ends, dimensionless; positive.
    pub end: f64,
}

/// Bending rigidities per width of a strip \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingRigidity {
    /// B1, of a strip cut along the warp.
    pub warp: f64,
    /// B2, of a strip cut along the weft.
    pub weft: f64,
    /// B45, of a strip cut at 45 degrees to them. `None` where it was not measured:
    /// (B1 + B2 + 2 (B1 B2)^1/2) / 4, as for a slab that twists like the geometric mean of both (Huber 1923).
    pub bias: Option<f64>,
}

/// The rigidities as those of an orthotropic plate \[N m\] (NUMERICS §12): the energy per area of curvatures k is
/// (D11 k11^2 + D22 k22^2 + 2 D12 k11 k22 + 4 D66 k12^2) / 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateRigidity {
    /// D11 = B1.
    pub warp: f64,
    /// D22 = B2.
    pub weft: f64,
    /// D12.
    pub coupling: f64,
    /// D66.
    pub twist: f64,
}

impl TensileCurve {
    /// A straight line with this slope \[N/m\].
    #[must_use]
    pub const fn linear(slope: f64) -> Self {
        Self { linear: slope, cubic: 0.0, end: 1.0 }
    }

    /// The steepest slope \[N/m\].
    #[must_use]
    pub fn steepest(&self) -> f64 {
        self.linear + 3.0 * self.cubic * self.end * self.end
    }

    fn validate(&self, what: &str) -> Result<(), FabricError> {
        positive(|| format!("slope at rest of the tensile curve of {what}"), self.linear)?;
        not_negative(|| format!("cubic term of the tensile curve of {what}"), self.cubic)?;
        positive(|| format!("end of the tensile curve of {what}"), self.end)?;
        finite(|| format!("steepest slope of the tensile curve of {what}"), self.steepest())?;
        Ok(())
    }
}

impl BendingRigidity {
    /// The same in all directions \[N m\].
    #[must_use]
    pub const fn isotropic(rigidity: f64) -> Self {
        Self { warp: rigidity, weft: rigidity, bias: None }
    }

    /// B3 = (4 B45 - B1 - B2) / 2, the mixed term of [`Self::along`] \[N m\].
    #[must_use]
    pub fn mixed(&self) -> f64 {
        self.bias.map_or_else(
            || (self.warp * self.weft).sqrt(),
            |bias| 0.5 * (4.0 * bias - self.warp - self.weft),
        )
    }

    /// Rigidity of a strip whose length makes an angle with the warp \[N m\]: B1 cos^4 + B2 sin^4 + 2 B3 sin^2 cos^2. The
    /// argument is the cosine and sine of the angle.
    #[must_use]
    pub fn along(&self, [cosine, sine]: [f64; 2]) -> f64 {
        let [c2, s2] = [cosine * cosine, sine * sine];
        self.warp * c2 * c2 + self.weft * s2 * s2 + 2.0 * self.mixed() * s2 * c2
    }

    /// The plate that has these rigidities in every direction. They say D12 + 2 D66 = B3 alone; it is given to the twist, as woven
    /// cloth hardly bends one way when it is bent the other, and to D12 where that would leave the twist with too little.
    #[must_use]
    pub fn plate(&self) -> PlateRigidity {
        let mixed = self.mixed();
        let least = TWIST_SHARE * (self.warp * self.weft).sqrt();
        let twist = 0.5 * mixed.max(least);
        PlateRigidity { warp: self.warp, weft: self.weft, coupling: mixed - 2.0 * twist, twist }
    }

    pub(super) fn validate(&self, fabric: &str) -> Result<(), FabricError> {
        let Self { warp, weft, bias } = *self;
        positive(|| format!("bending rigidity along the warp of {fabric}"), warp)?;
        positive(|| format!("bending rigidity along the weft of {fabric}"), weft)?;
        let Some(bias) = bias else { return Ok(()) };
        positive(|| format!("bending rigidity at 45 degrees of {fabric}"), bias)?;
        // Then |D12| <= (1 - TWIST_SHARE) (B1 B2)^1/2, and the plate resists every curvature.
        let least_mixed = -(1.0 - 2.0 * TWIST_SHARE) * (warp * weft).sqrt();
        if self.mixed() < least_mixed {
            let least = 0.25 * (warp + weft + 2.0 * least_mixed);
            return Err(FabricError::BiasRigidity {
                fabric: fabric.into(),
                bias,
                warp,
                weft,
                least,
            });
        }
        Ok(())
    }
}

/// Rayleigh damping that stands for one that was not measured \[s\], for stretching and bending. The first calms what a stretched thread
/// does within a few milliseconds and hardly shortens explicit steps of cells of 5 mm and more; the second takes a swinging fold of 5 Hz about
/// 3 % of its amplitude in each period: the rest is that of the air and of friction.
pub const USUAL_DAMPING: [f64; 2] = [2e-5, 1e-3];

impl Fabric {
    /// The same with [`USUAL_DAMPING`].
    #[must_use]
    pub const fn with_usual_damping(self) -> Self {
        Self { damping: USUAL_DAMPING, ..self }
    }

    /// The largest coupling that these curves allow \[N/m\]: c^2 <= 0.95 psi_u'' psi_v'' for every strain, because the slopes are
    /// least at rest.
    #[must_use]
    pub fn largest_coupling(warp: &TensileCurve, weft: &TensileCurve) -> f64 {
        (COUPLING_SHARE * warp.linear * weft.linear).sqrt()
    }

    /// All its numbers, for a hash.
    pub(crate) fn numbers(&self) -> Vec<f64> {
        let Self {
            area_density,
            thickness,
            warp,
            weft,
            coupling,
            shear,
            bending,
            friction,
            damping,
        } = *self;
        let bias = bending.bias.unwrap_or(-1.0);
        let mut numbers = vec![area_density, thickness, coupling, shear];
        [warp, weft].iter().for_each(|c| numbers.extend([c.linear, c.cubic, c.end]));
        numbers.extend([bending.warp, bending.weft, bias, friction.shear, friction.bending]);
        numbers.extend(damping);
        numbers
    }

    /// Checks all numbers; `owner` is whose fabric it is, for the error.
    ///
    /// # Errors
    /// The first value that makes no sense, with what mends it.
    pub fn validate(&self, owner: &str) -> Result<(), FabricError> {
        positive(|| format!("mass per area of {owner}"), self.area_density)?;
        positive(|| format!("thickness of {owner}"), self.thickness)?;
        self.warp.validate(&format!("the warp of {owner}"))?;
        self.weft.validate(&format!("the weft of {owner}"))?;
        positive(|| format!("shear stiffness of {owner}"), self.shear)?;
        finite(|| format!("biaxial coupling of {owner}"), self.coupling)?;
        let largest = Self::largest_coupling(&self.warp, &self.weft);
        if self.coupling.abs() > largest {
            return Err(FabricError::Coupling {
                fabric: owner.into(),
                coupling: self.coupling,
                warp: self.warp.linear,
                weft: self.weft.linear,
                largest,
            });
        }
        self.bending.validate(owner)?;
        let InternalFriction { shear, bending } = self.friction;
        not_negative(|| format!("friction in shear of {owner}"), shear)?;
        not_negative(|| format!("friction in bending of {owner}"), bending)?;
        for (what, damping) in ["stretching", "bending"].into_iter().zip(self.damping) {
            not_negative(|| format!("damping of {what} of {owner}"), damping)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn poplin() -> Fabric {
        Fabric {
            area_density: 0.15,
            thickness: 0.3e-3,
            warp: TensileCurve { linear: 800.0, cubic: 2e5, end: 0.05 },
            weft: TensileCurve { linear: 300.0, cubic: 4e4, end: 0.1 },
            coupling: 90.0,
            shear: 40.0,
            bending: BendingRigidity { warp: 8e-6, weft: 4e-6, bias: Some(3e-6) },
            friction: InternalFriction::default(),
            damping: [0.0; 2],
        }
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        assert_eq!(poplin().validate("poplin"), Ok(()));
        let message = |change: &dyn Fn(&mut Fabric)| {
            let mut fabric = poplin();
            change(&mut fabric);
            fabric.validate("poplin").unwrap_err().to_string()
        };
        type Change<'a> = &'a dyn Fn(&mut Fabric);
        let wrong: [(Change<'_>, &str); 9] = [
            (&|f| f.area_density = 0.0, "mass per area"),
            (&|f| f.thickness = f64::NAN, "thickness"),
            (&|f| f.warp.linear = -1.0, "slope at rest of the tensile curve of the warp"),
            (&|f| f.weft.cubic = -1.0, "cubic term of the tensile curve of the weft"),
            (&|f| f.weft.end = 0.0, "end of the tensile curve of the weft"),
            (&|f| f.shear = 0.0, "shear"),
            (&|f| f.coupling = 478.0, "between -477.49"),
            (&|f| f.bending.bias = Some(0.7e-6), "at 45 degrees"),
            (&|f| f.damping[1] = -1.0, "damping of bending"),
        ];
        for (change, words) in wrong {
            let message = message(change);
            assert!(message.contains(words) && message.contains("poplin"), "{words}: {message}");
        }
    }

    #[test]
    fn rigidity_is_what_was_measured_in_three_directions() {
        let bending = poplin().bending;
        let half = 0.5_f64.sqrt();
        for (direction, expected) in [([1.0, 0.0], 8e-6), ([0.0, 1.0], 4e-6), ([half; 2], 3e-6)] {
            assert!((bending.along(direction) - expected).abs() < 1e-20);
        }
        // A plate bent to a cylinder about any axis has the rigidity along its circles.
        let plate = bending.plate();
        for degrees in 0..36 {
            let (s, c) = (10.0 * f64::from(degrees)).to_radians().sin_cos();
            let [k11, k22, k12] = [c * c, s * s, s * c];
            let found = plate.warp * k11 * k11
                + plate.weft * k22 * k22
                + 2.0 * plate.coupling * k11 * k22
                + 4.0 * plate.twist * k12 * k12;
            assert!((found - bending.along([c, s])).abs() < 1e-18, "{degrees}");
        }
        let isotropic = BendingRigidity::isotropic(5e-6);
        assert!((isotropic.along([0.6, 0.8]) - 5e-6).abs() < 1e-20);
    }

    #[test]
    fn every_valid_plate_resists_every_curvature() {
        for bias in [2.74e-6 / 4.0, 1e-6, 3e-6, 1e-5] {
            let bending = BendingRigidity { warp: 8e-6, weft: 4e-6, bias: Some(bias) };
            if bending.validate("plate").is_ok() {
                let plate = bending.plate();
                assert!(plate.twist > 0.0);
                assert!(plate.coupling * plate.coupling < plate.warp * plate.weft, "{bias}");
            }
        }
    }
}
