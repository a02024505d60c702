//! What a cloth is made of.

use crate::{
    ModelError,
    error::{not_negative, positive},
};

/// Mechanical properties of one cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// How mass is given to the particles.
    pub mass: Mass,
    /// Springs along the threads or edges.
    pub stretch: SpringCoefficients,
    /// Springs across the diagonals of a grid.
    pub shear: SpringCoefficients,
    /// Springs that resist folding.
    pub bend: SpringCoefficients,
    /// What those springs do under compression.
    pub bend_model: BendModel,
    /// Coefficients of the force of the air.
    pub aerodynamics: Aerodynamics,
    /// Thickness of the cloth \[m\]: colliders stop its particles at half of it.
    pub thickness: f64,
}

/// How mass is given to the particles of a cloth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mass {
    /// Mass per area \[kg/m^2\]; each triangle gives a third of its mass to each corner.
    PerArea(f64),
    /// The same mass for every particle \[kg\].
    PerParticle(f64),
}

/// Stiffness and damping of one class of springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringCoefficients {
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Damping along the spring \[N s/m\].
    pub damping: f64,
}

/// Ratio of the spring damping to the critical damping of one particle on one spring. Measured
/// values of this kind are not published; a twentieth lets a patch ring for a few periods.
const DAMPING_RATIO: f64 = 0.05;

impl SpringCoefficients {
    /// A spring of so much stiffness \[N/m\] whose damping nobody knows, between particles of mass `mass` \[kg\]: it gets a twentieth
    /// of the critical damping 2 (k m)^(1/2) of one particle on it.
    #[must_use]
    pub fn with_usual_damping(stiffness: f64, mass: f64) -> Self {
        Self { stiffness, damping: DAMPING_RATIO * 2.0 * (stiffness * mass).sqrt() }
    }
}

/// What a bend spring does under compression (NUMERICS §2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BendModel {
    /// It resists with its stiffness, as under tension. It feels nothing of a fold until particles
    /// come closer by the second order of the angle, and then all of its stiffness.
    #[default]
    Linear,
    /// It buckles: the force of an elastic strut bent to the length of the spring (Choi and Ko
    /// 2002, "Stable but responsive cloth").
    ///
    /// The stiffness of the spring is then that of the ramp to the buckled force, and limits how
    /// suddenly it sets in. The spring buckles at a compression of about 12 B / (k L^3), with
    /// rigidity B, stiffness k and rest length L: choose k of some hundred B / L^3, so that this is
    /// a few percent. Above B = 0.0319 k L^3 it never buckles
    /// ([`SpringKind::buckling_onset`](crate::SpringKind::buckling_onset) tells).
    ImmediateBuckling {
        /// Flexural rigidity B of one spring \[N m^2\], above zero.
        ///
        /// A measured bending stiffness is a rigidity per width \[N m^2/m = N m\]: multiply it by
        /// the width of the strip of cloth that one spring stands for, its share of the area
        /// divided by its length. On a grid of 12 neighbours with spacing d each particle has one
        /// bend spring of length 2 d in each direction, so that the width is d / 2.
        rigidity: f64,
    },
}

impl BendModel {
    /// Flexural rigidity of one spring \[N m^2\], if there is one.
    #[must_use]
    pub const fn rigidity(&self) -> Option<f64> {
        match self {
            Self::Linear => None,
            Self::ImmediateBuckling { rigidity } => Some(*rigidity),
        }
    }
}

/// Coefficients of the force of the air on a triangle (NUMERICS §3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aerodynamics {
    /// Pressure drag coefficient, dimensionless; 1.28 for a flat plate across the flow (Hoerner
    /// 1965, Fluid-Dynamic Drag, chapter 3).
    pub pressure: f64,
    /// Skin friction coefficient, dimensionless.
    pub friction: f64,
}

impl Default for Aerodynamics {
    fn default() -> Self {
        Self { pressure: 1.28, friction: 0.02 }
    }
}

impl Material {
    pub(crate) fn validate(&self, cloth: &str) -> Result<(), ModelError> {
        match self.mass {
            Mass::PerArea(value) => {
                positive(|| format!("mass per area of cloth {cloth:?}"), value)?;
            }
            Mass::PerParticle(value) => {
                positive(|| format!("mass per particle of cloth {cloth:?}"), value)?;
            }
        }
        for (class, coefficients) in
            [("stretch", self.stretch), ("shear", self.shear), ("bend", self.bend)]
        {
            positive(|| format!("{class} stiffness of cloth {cloth:?}"), coefficients.stiffness)?;
            not_negative(|| format!("{class} damping of cloth {cloth:?}"), coefficients.damping)?;
        }
        if let Some(rigidity) = self.bend_model.rigidity() {
            positive(|| format!("bend rigidity of cloth {cloth:?}"), rigidity)?;
        }
        not_negative(
            || format!("pressure coefficient of cloth {cloth:?}"),
            self.aerodynamics.pressure,
        )?;
        not_negative(
            || format!("friction coefficient of the air on cloth {cloth:?}"),
            self.aerodynamics.friction,
        )?;
        positive(|| format!("thickness of cloth {cloth:?}"), self.thickness)?;
        Ok(())
    }
}
