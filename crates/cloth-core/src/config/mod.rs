//! How a solver is to work: precision, time step, integrator.

mod implicit;
mod linear;
mod names;
mod strain_limit;
mod time_step;

use std::{num::NonZeroUsize, str::FromStr};

pub use implicit::{
    ImplicitSettings, MidpointSettings, NewtonSettings, SemiImplicitSettings, SemiImplicitSolve,
};
pub use linear::{
    AutoPreconditioner, LinearMethod, LinearSettings, LinearStop, MatrixForm, Preconditioner,
};
pub use strain_limit::StrainLimit;
pub use time_step::{AdaptiveSettings, TimeStepControl};

use crate::{Model, ModelError, error::positive};

/// Settings of a solver. They hold for its whole life.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverConfig {
    /// Precision of the state and of all arithmetic.
    pub precision: Precision,
    /// Length of a substep \[s\]; the last one of a frame is shorter.
    pub time_step: f64,
    /// Whether the length of substeps may be halved where that is needed.
    pub time_step_control: TimeStepControl,
    /// How the state is advanced.
    pub integrator: Integrator,
    /// Strain limiting after every substep, whatever the integrator.
    pub strain_limit: Option<StrainLimit>,
    /// Threads that a CPU backend uses, or all there are.
    pub threads: Option<NonZeroUsize>,
    /// Relative elongation of an edge or a diagonal above which the simulation counts as diverged
    /// ([`Measures::strain_max`](crate::Measures::strain_max)).
    pub strain_bound: f64,
    /// What becomes of cloth that bodies pinch.
    pub pinch: Pinch,
}

/// What becomes of cloth that bodies press on each other without room for it, in contact of triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pinch {
    /// The run ends with the place and the name of the body.
    #[default]
    Refuse,
    /// Its particles are left inside of the bodies, held between their faces, until they are outside again; they are counted (NUMERICS §15).
    Ghost,
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
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Integrator {
    /// Symplectic Euler (NUMERICS §4).
    #[default]
    Explicit,
    /// Backward Euler after Baraff and Witkin (NUMERICS §5).
    Implicit(ImplicitSettings),
    /// The implicit midpoint rule with damping of what is fast, and angular momentum kept (NUMERICS §5).
    Midpoint(MidpointSettings),
    /// Backward Euler with a constant matrix, after Desbrun, Schröder and Barr (NUMERICS §6).
    SemiImplicit(SemiImplicitSettings),
}

impl Integrator {
    /// How it solves a linear system that changes with the state, if it does.
    #[must_use]
    pub const fn linear(&self) -> Option<&LinearSettings> {
        match self {
            Self::Implicit(ImplicitSettings { linear, .. })
            | Self::Midpoint(MidpointSettings { linear, .. }) => Some(linear),
            Self::Explicit | Self::SemiImplicit(_) => None,
        }
    }
}

impl Default for SolverConfig {
    fn default() -> Self {
        Self {
            precision: Precision::F32,
            time_step: 1e-3,
            time_step_control: TimeStepControl::Fixed,
            integrator: Integrator::Explicit,
            strain_limit: None,
            threads: None,
            strain_bound: 10.0,
            pinch: Pinch::Refuse,
        }
    }
}

impl SolverConfig {
    /// The same with a preconditioner in place of [`Preconditioner::Auto`], as [`Preconditioner::resolved`] has it.
    #[must_use]
    pub fn resolved(&self, model: &Model, schwarz_min: Option<usize>) -> Self {
        let mut resolved = self.clone();
        if let Integrator::Implicit(ImplicitSettings { linear, .. })
        | Integrator::Midpoint(MidpointSettings { linear, .. }) = &mut resolved.integrator
        {
            linear.preconditioner = linear.preconditioner.resolved(model, schwarz_min);
        }
        resolved
    }

    /// The preconditioner that linear systems are solved with, if there is one.
    #[must_use]
    pub fn preconditioner(&self) -> Option<Preconditioner> {
        let linear = self.integrator.linear()?;
        (linear.method == LinearMethod::ConjugateGradient).then_some(linear.preconditioner)
    }

    /// Checks every number.
    ///
    /// # Errors
    /// A [`ModelError`] that names the setting.
    pub fn validate(&self) -> Result<(), ModelError> {
        positive(|| "time step".into(), self.time_step)?;
        positive(|| "strain bound".into(), self.strain_bound)?;
        self.time_step_control.validate()?;
        if let Some(limit) = &self.strain_limit {
            limit.validate()?;
        }
        match &self.integrator {
            Integrator::Explicit | Integrator::SemiImplicit(_) => Ok(()),
            Integrator::Implicit(settings) => settings.validate(),
            Integrator::Midpoint(settings) => settings.validate(),
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
