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
