//! What a cloth is made of, as the elements need it.

use super::{FabricError, InternalFriction};
use crate::error::{finite, not_negative, positive};

/// Largest part of psi_u'' psi_v'' that the square of the coupling may be (NUMERICS §11).
pub const COUPLING_SHARE: f64 = 0.95;

/// Shares of (B1 B2)^1/2 that D66 has at least, so that no bent shape is free, and at most: four times that of a sheet that twists as
/// easily as it bends.
const TWIST_SHARES: [f64; 2] = [0.02, 2.0];

/// Largest D12 (NUMERICS §12), as a share of (D11 D22)^1/2.
const POISSON_SHARE: f64 = 0.9;

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
    /// Largest principal stretch, above 1; infinite for none. Threads jam before it ([`Self::locking`]), and where contact of triangles proves
    /// motion, no motion takes a triangle beyond it.
    pub stretch_limit: f64,
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

/// How the threads of a fabric jam before its largest stretch (NUMERICS §11): E11, E22 and |E12| that exceed `onset` meet a stress of
/// `rise` times the square of what is beyond it, and a straight line beyond the whole `range`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Locking {
    /// Green strain at which threads begin to jam.
    pub onset: f64,
    /// Green strain from there to the largest one.
    pub range: f64,
    /// Coefficient \[N/m\].
    pub rise: f64,
}

impl Locking {
    /// Where nothing jams: a strain that no cloth has.
    const NONE: Self = Self { onset: 1e30, range: 1.0, rise: 0.0 };

    /// The steepest slope \[N/m\].
    #[must_use]
    pub fn steepest(&self) -> f64 {
        2.0 * self.rise * self.range
    }
}

/// Bending rigidities per width of a strip \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendingRigidity {
    /// B1, of a strip cut along the warp.
    pub warp: f64,
    /// B2, of a strip cut along the weft.
    pub weft: f64,
    /// B45, of a narrow strip cut at 45 degrees to them. `None` where it was not measured: D66 is then (B1 B2)^1/2 / 2, as for a slab
    /// that twists like the geometric mean of both (Huber 1923).
    pub bias: Option<f64>,
}

/// The rigidities as those of an orthotropic plate \[N m\] (NUMERICS §12): the energy per area of curvatures k is
/// (D11 k11^2 + D22 k22^2 + 2 D12 k11 k22 + 4 D66 k12^2) / 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateRigidity {
    /// D11; B1 where D12 is 0.
    pub warp: f64,
    /// D22; B2 where D12 is 0.
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

    /// The plate of which narrow strips have these rigidities. A strip whose borders are free takes a moment along itself alone, and
    /// twists and bends across as it likes: 1/B is the compliance of the plate along it. At 45 degrees
    ///
    /// 4 / B45 = 1/B1 + 1/B2 + 1/D66 + 2 S12,  S12 = -D12 / (D11 D22 - D12^2)
    ///
    /// (Lekhnitskii 1968, of plates). One number says both D66 and D12; D12 is 0, as woven cloth hardly bends one way when it is bent the
    /// other, unless no D66 is large enough. Where no D12 is either, the bias is as near as a plate comes.
    #[must_use]
    pub fn plate(&self) -> PlateRigidity {
        let mean = (self.warp * self.weft).sqrt();
        let Some(bias) = self.bias else {
            let Self { warp, weft, .. } = *self;
            return PlateRigidity { warp, weft, coupling: 0.0, twist: 0.5 * mean };
        };
        let most = TWIST_SHARES[1] * mean;
        let compliance = 4.0 / bias - 1.0 / self.warp - 1.0 / self.weft;
        let twist = if compliance * most > 1.0 { compliance.recip() } else { most };
        // S12 (B1 B2)^1/2, which is -D12 / (D11 D22)^1/2.
        let mixed = (0.5 * (compliance - twist.recip()) * mean).clamp(-POISSON_SHARE, 0.0);
        // Where it was not limited, D66 was, or rounding is all that there is.
        let mixed = if twist < most { 0.0 } else { mixed };
        let share = 1.0 / (1.0 - mixed * mixed);
        PlateRigidity {
            warp: self.warp * share,
            weft: self.weft * share,
            coupling: -mixed * mean * share,
            twist,
        }
    }

    pub(super) fn validate(&self, fabric: &str) -> Result<(), FabricError> {
        let Self { warp, weft, bias } = *self;
        positive(|| format!("bending rigidity along the warp of {fabric}"), warp)?;
        positive(|| format!("bending rigidity along the weft of {fabric}"), weft)?;
        let Some(bias) = bias else { return Ok(()) };
        positive(|| format!("bending rigidity at 45 degrees of {fabric}"), bias)?;
        let least_twist = TWIST_SHARES[0] * (warp * weft).sqrt();
        let least = 4.0 / (warp.recip() + weft.recip() + least_twist.recip());
        if bias < least {
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

impl PlateRigidity {
    /// Rigidity of a narrow strip whose length has this cosine and sine to the warp \[N m\].
    #[must_use]
    pub fn strip(&self, [cosine, sine]: [f64; 2]) -> f64 {
        let Self { warp, weft, coupling, twist } = *self;
        let [c2, s2] = [cosine * cosine, sine * sine];
        let determinant = warp * weft - coupling * coupling;
        let bent = (weft * c2 * c2 + warp * s2 * s2 - 2.0 * coupling * c2 * s2) / determinant;
        (bent + c2 * s2 / twist).recip()
    }

    /// Rigidity of a plate bent to a cylinder, whose circles have this cosine and sine to the warp \[N m\].
    #[must_use]
    pub fn cylinder(&self, [cosine, sine]: [f64; 2]) -> f64 {
        let [c2, s2] = [cosine * cosine, sine * sine];
        let mixed = self.coupling + 2.0 * self.twist;
        self.warp * c2 * c2 + self.weft * s2 * s2 + 2.0 * mixed * s2 * c2
    }
}

/// Rayleigh damping that stands for one that was not measured \[s\], for stretching and bending. The first calms what a stretched thread
/// does within a few milliseconds and hardly shortens explicit steps of cells of 5 mm and more; the second takes a swinging fold of 5 Hz about
/// 3 % of its amplitude in each period: the rest is that of the air and of friction.
pub const USUAL_DAMPING: [f64; 2] = [2e-5, 1e-3];

/// The least limit of stretches that cloth could move under.
const STRETCH_LIMIT_MIN: f64 = 1.001;

/// Share of the largest Green strain at which threads begin to jam.
const LOCKING_ONSET: f64 = 0.75;

/// Slope of threads that jam at the largest stretch, in units of that of the steeper thread: much against shear, and little enough that explicit
/// steps stay nearly as long.
const LOCKING_SLOPE: f64 = 0.25;

/// E12 of threads that have turned towards each other by 40 degrees: sin(40 deg) / 2.
const USUAL_SHEAR_MAX: f64 = 0.32;

/// Factors of the properties of a fabric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FabricScale {
    /// Of the mass per area.
    pub density: f64,
    /// Of the stiffness against stretching and shearing, and of the friction in shear.
    pub stretch: f64,
    /// Of the bending rigidity, and of the friction in bending.
    pub bend: f64,
    /// Of the times of damping.
    pub damping: f64,
}

impl FabricScale {
    /// What changes nothing.
    pub const ONE: Self = Self { density: 1.0, stretch: 1.0, bend: 1.0, damping: 1.0 };
}

impl Fabric {
    /// So many layers that lie on each other and are stretched and bent together, but slide: mass, thickness, stiffness, rigidity and friction are
    /// as many times as large.
    #[must_use]
    pub fn layers(&self, count: u32) -> Self {
        let n = f64::from(count);
        let all = FabricScale { density: n, stretch: n, bend: n, damping: 1.0 };
        Self { thickness: n * self.thickness, ..self.scaled(&all) }
    }

    /// The same with more or less of some of its properties.
    #[must_use]
    pub fn scaled(&self, scale: &FabricScale) -> Self {
        let FabricScale { density, stretch, bend, damping } = *scale;
        let curve = |curve: TensileCurve| TensileCurve {
            linear: stretch * curve.linear,
            cubic: stretch * curve.cubic,
            ..curve
        };
        let BendingRigidity { warp, weft, bias } = self.bending;
        Self {
            area_density: density * self.area_density,
            warp: curve(self.warp),
            weft: curve(self.weft),
            coupling: stretch * self.coupling,
            shear: stretch * self.shear,
            bending: BendingRigidity {
                warp: bend * warp,
                weft: bend * weft,
                bias: bias.map(|bias| bend * bias),
            },
            friction: InternalFriction {
                shear: stretch * self.friction.shear,
                bending: bend * self.friction.bending,
            },
            damping: self.damping.map(|time| damping * time),
            ..*self
        }
    }

    /// How threads jam: from three quarters of the Green strain of the largest stretch on, in the end with a quarter of the slope of the steeper
    /// thread, and with more of it the tighter the limit is.
    #[must_use]
    pub fn locking(&self) -> Locking {
        if self.stretch_limit == f64::INFINITY {
            return Locking::NONE;
        }
        let largest = 0.5 * (self.stretch_limit * self.stretch_limit - 1.0);
        let range = (1.0 - LOCKING_ONSET) * largest;
        let steepest = self.warp.steepest().max(self.weft.steepest());
        let tightness = (USUAL_SHEAR_MAX / largest).max(1.0);
        let slope = LOCKING_SLOPE * tightness * tightness * steepest;
        let rise = 0.5 * slope / range;
        Locking { onset: LOCKING_ONSET * largest, range, rise }
    }

    /// The same with a largest stretch that stands for one that was not measured: that along the bias where threads at right angles have turned
    /// towards each other by 40 degrees, as woven cloth locks at some 30 to 50. Where a curve was measured farther, the threads jam behind its end.
    #[must_use]
    pub fn with_usual_stretch_limit(self) -> Self {
        let measured = |curve: &TensileCurve| if curve.cubic > 0.0 { curve.end } else { 0.0 };
        let farthest = measured(&self.warp).max(measured(&self.weft));
        let largest = USUAL_SHEAR_MAX.max(farthest / LOCKING_ONSET);
        Self { stretch_limit: (1.0 + 2.0 * largest).sqrt(), ..self }
    }

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
            stretch_limit,
        } = *self;
        let bias = bending.bias.unwrap_or(-1.0);
        let mut numbers = vec![area_density, thickness, coupling, shear];
        [warp, weft].iter().for_each(|c| numbers.extend([c.linear, c.cubic, c.end]));
        numbers.extend([bending.warp, bending.weft, bias, friction.shear, friction.bending]);
        numbers.extend(damping);
        numbers.push(stretch_limit);
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
        if self.stretch_limit.is_nan() || self.stretch_limit < STRETCH_LIMIT_MIN {
            return Err(FabricError::StretchLimit {
                fabric: owner.into(),
                limit: self.stretch_limit,
                least: STRETCH_LIMIT_MIN,
            });
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
            stretch_limit: f64::INFINITY,
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
        let wrong: [(Change<'_>, &str); 11] = [
            (&|f| f.area_density = 0.0, "mass per area"),
            (&|f| f.thickness = f64::NAN, "thickness"),
            (&|f| f.warp.linear = -1.0, "slope at rest of the tensile curve of the warp"),
            (&|f| f.weft.cubic = -1.0, "cubic term of the tensile curve of the weft"),
            (&|f| f.weft.end = 0.0, "end of the tensile curve of the weft"),
            (&|f| f.shear = 0.0, "shear"),
            (&|f| f.coupling = 478.0, "between -477.49"),
            (&|f| f.bending.bias = Some(0.4e-6), "at 45 degrees"),
            (&|f| f.damping[1] = -1.0, "damping of bending"),
            (&|f| f.stretch_limit = 1.0, "largest stretch"),
            (&|f| f.stretch_limit = f64::NAN, "largest stretch"),
        ];
        for (change, words) in wrong {
            let message = message(change);
            assert!(message.contains(words) && message.contains("poplin"), "{words}: {message}");
        }
    }

    #[test]
    fn strips_of_the_plate_have_what_was_measured_in_three_directions() {
        let half = 0.5_f64.sqrt();
        // The last one needs a D12.
        for bias in [0.5e-6, 3e-6, 4.5e-6, 7e-6, 9e-6] {
            let bending = BendingRigidity { warp: 8e-6, weft: 4e-6, bias: Some(bias) };
            let plate = bending.plate();
            for (direction, expected) in [([1.0, 0.0], 8e-6), ([0.0, 1.0], 4e-6), ([half; 2], bias)]
            {
                let found = plate.strip(direction);
                assert!((found - expected).abs() < 1e-18, "{bias}: {found} for {expected}");
            }
            assert_eq!(plate.coupling > 0.0, bias > 8.7e-6, "{bias}");
        }
        // An isotropic plate without a Poisson ratio is the same in every direction, bent either way.
        let plate = BendingRigidity::isotropic(5e-6).plate();
        assert!((plate.strip([0.6, 0.8]) - 5e-6).abs() < 1e-20);
        assert!((plate.cylinder([0.6, 0.8]) - 5e-6).abs() < 1e-20);
        let measured = BendingRigidity { bias: Some(5e-6), ..BendingRigidity::isotropic(5e-6) };
        assert!((measured.plate().twist - 2.5e-6).abs() < 1e-20);
    }

    #[test]
    fn every_valid_plate_resists_every_curvature() {
        for bias in [0.45e-6, 1e-6, 3e-6, 1e-5, 1e-3] {
            let bending = BendingRigidity { warp: 8e-6, weft: 4e-6, bias: Some(bias) };
            assert!(bending.validate("plate").is_ok(), "{bias}");
            let plate = bending.plate();
            assert!(plate.twist > 0.0);
            assert!(plate.coupling * plate.coupling < plate.warp * plate.weft, "{bias}");
        }
    }
}
