//! How a solver is to work: precision, time step, integrator.

use std::{num::NonZeroUsize, str::FromStr};

use crate::{
    ModelError, SpringClass,
    error::{in_range, positive},
};

/// Settings of a solver. They hold for its whole life.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverConfig {
    /// Precision of the state and of all arithmetic.
    pub precision: Precision,
    /// Length of a substep \[s\]; the last one of a frame is shorter.
    pub time_step: f64,
    /// How the state is advanced.
    pub integrator: Integrator,
    /// Threads that a CPU backend uses, or all there are.
    pub threads: Option<NonZeroUsize>,
    /// Relative elongation of a spring above which the simulation counts as diverged.
    pub strain_bound: f64,
}

/// Precision of the arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floating point.
    #[default]
    F32,
    /// 64-bit floating point.
    F64,
}

/// How the state is advanced.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Integrator {
    /// Symplectic Euler with optional strain limiting (NUMERICS §4).
    Explicit(ExplicitSettings),
}

/// Settings of the explicit integrator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExplicitSettings {
    /// Strain limiting after every substep.
    pub strain_limit: Option<StrainLimit>,
}

/// Provot's deformation constraints: springs that are too long are shortened (NUMERICS §4).
#[derive(Clone, Debug, PartialEq)]
pub struct StrainLimit {
    /// Largest length in units of the rest length, above 1; 1.1 in Provot (1995).
    pub ratio: f64,
    /// Sweeps over all colours in each substep.
    pub sweeps: u32,
    /// Classes of springs that are limited.
    pub classes: Vec<SpringClass>,
}

impl Default for StrainLimit {
    fn default() -> Self {
        Self { ratio: 1.1, sweeps: 1, classes: vec![SpringClass::Stretch, SpringClass::Shear] }
    }
}

impl Default for SolverConfig {
    fn default() -> Self {
        Self {
            precision: Precision::F32,
            time_step: 1e-3,
            integrator: Integrator::Explicit(ExplicitSettings::default()),
            threads: None,
            strain_bound: 10.0,
        }
    }
}

impl SolverConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// A [`ModelError`] that names the setting.
    pub fn validate(&self) -> Result<(), ModelError> {
        positive(|| "time step".into(), self.time_step)?;
        positive(|| "strain bound".into(), self.strain_bound)?;
        match &self.integrator {
            Integrator::Explicit(settings) => {
                if let Some(limit) = &settings.strain_limit {
                    in_range(|| "ratio of the strain limit".into(), limit.ratio, [1.0, 1e6])?;
                    positive(|| "sweeps of the strain limit".into(), f64::from(limit.sweeps))?;
                }
            }
        }
        Ok(())
    }

    /// The strain limit of the integrator, if it has one.
    #[must_use]
    pub const fn strain_limit(&self) -> Option<&StrainLimit> {
        match &self.integrator {
            Integrator::Explicit(settings) => settings.strain_limit.as_ref(),
        }
    }
}

impl FromStr for Precision {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "f32" => Ok(Self::F32),
            "f64" => Ok(Self::F64),
            _ => Err(format!("unknown precision {name:?}: use f32 or f64")),
        }
    }
}

impl std::fmt::Display for Precision {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}
