//! What acts on all cloths from outside: fields, air (NUMERICS §3).

use std::sync::Arc;

use crate::{
    FieldProgram, ModelError,
    error::{finite_all, not_negative},
};

/// A force field that acts on every free particle.
#[derive(Clone, Debug, PartialEq)]
pub enum Field {
    /// The same acceleration everywhere, as gravity is \[m/s^2\].
    Uniform {
        /// Acceleration \[m/s^2\].
        acceleration: [f64; 3],
    },
    /// A braking force against the velocity, with a rate per axis: a = -rate v.
    Drag {
        /// Rate for each axis \[1/s\].
        rate: [f64; 3],
    },
    /// A force \[N\] as an expression of position, velocity, time, mass and index.
    Procedural {
        /// The expression.
        program: Arc<FieldProgram>,
    },
}

impl Field {
    pub(crate) fn validate(&self, index: usize) -> Result<(), ModelError> {
        match self {
            Self::Uniform { acceleration } => {
                finite_all(|| format!("acceleration of field {index}"), acceleration)
            }
            Self::Drag { rate } => {
                for &value in rate {
                    not_negative(|| format!("drag rate of field {index}"), value)?;
                }
                Ok(())
            }
            // Whatever compiles is valid.
            Self::Procedural { .. } => Ok(()),
        }
    }
}

/// The air around the cloths. Without it no aerodynamic force is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Density \[kg/m^3\]; 1.204 for dry air at 20 degrees Celsius and sea level.
    pub density: f64,
    /// Wind velocity \[m/s\].
    pub wind_velocity: [f64; 3],
    /// Gusts on top of it.
    pub gust: Option<Gust>,
}

/// A wind that swells and dies down: the wind velocity is multiplied by
/// 1 + amplitude sin(2 pi frequency t).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gust {
    /// Relative amplitude, dimensionless.
    pub amplitude: f64,
    /// Frequency \[Hz\].
    pub frequency: f64,
}

impl Air {
    /// Dry air at 20 degrees Celsius with a steady wind \[m/s\].
    #[must_use]
    pub const fn with_wind(wind_velocity: [f64; 3]) -> Self {
        Self { density: 1.204, wind_velocity, gust: None }
    }

    /// Wind velocity \[m/s\] at `time` \[s\], if the steady part is `wind_velocity`.
    #[must_use]
    pub fn wind_at(&self, wind_velocity: [f64; 3], time: f64) -> [f64; 3] {
        let factor = self.gust.map_or(1.0, |gust| {
            1.0 + gust.amplitude * (std::f64::consts::TAU * gust.frequency * time).sin()
        });
        wind_velocity.map(|component| component * factor)
    }

    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        not_negative(|| "density of the air".into(), self.density)?;
        finite_all(|| "wind velocity".into(), &self.wind_velocity)?;
        if let Some(gust) = self.gust {
            not_negative(|| "amplitude of the gust".into(), gust.amplitude)?;
            not_negative(|| "frequency of the gust".into(), gust.frequency)?;
        }
        Ok(())
    }
}
