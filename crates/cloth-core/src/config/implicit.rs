//! Settings of the implicit, the midpoint and the semi-implicit integrator.

use crate::{
    ModelError,
    error::{in_range, positive},
};

use super::{LinearSettings, names::names};

/// Settings of the implicit integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitSettings {
    /// The linear system of each Newton iteration.
    pub linear: LinearSettings,
    /// Newton's method.
    pub newton: NewtonSettings,
    /// Times that a substep may solve its system, at most, because constraint forces of colliders
    /// pulled and were released.
    pub constraint_passes: u32,
}

/// Settings of Newton's method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NewtonSettings {
    /// Iterations in each substep; one gives the linearised step of Baraff and Witkin (1998).
    pub iterations_max: u32,
    /// Residual, relative to that of the first iteration, at which the iteration stops.
    pub tolerance: f64,
}

/// Settings of the midpoint integrator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MidpointSettings {
    /// The linear system of each substep.
    pub linear: LinearSettings,
    /// Where in a substep forces are taken, from 0.5, the middle, to 1, the end. What is fast against a substep loses
    /// all but (1 - weight) / weight of its amplitude in each.
    pub weight: f64,
}

/// Settings of the semi-implicit integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SemiImplicitSettings {
    /// How its constant system is solved.
    pub solve: SemiImplicitSolve,
}

/// How the constant system of the semi-implicit integrator is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum SemiImplicitSolve {
    /// A sparse factorisation, made once for a time step and used in every substep.
    #[default]
    Factorisation,
    /// The inverse as a dense matrix, as Desbrun, Schröder and Barr (1999) had it: n^2 numbers and
    /// operations. Kept for comparison.
    DenseInverse,
}

impl Default for ImplicitSettings {
    fn default() -> Self {
        Self {
            linear: LinearSettings::default(),
            newton: NewtonSettings::default(),
            constraint_passes: 4,
        }
    }
}

impl Default for MidpointSettings {
    fn default() -> Self {
        Self { linear: LinearSettings::default(), weight: 0.6 }
    }
}

impl MidpointSettings {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        self.linear.validate()?;
        in_range(|| "weight of the midpoint integrator".into(), self.weight, [0.5, 1.0])?;
        Ok(())
    }
}

impl Default for NewtonSettings {
    fn default() -> Self {
        Self { iterations_max: 1, tolerance: 1e-3 }
    }
}

impl ImplicitSettings {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        self.linear.validate()?;
        positive(|| "iterations of Newton's method".into(), f64::from(self.newton.iterations_max))?;
        in_range(|| "tolerance of Newton's method".into(), self.newton.tolerance, [0.0, 1.0])?;
        positive(|| "passes of the constraints".into(), f64::from(self.constraint_passes))?;
        Ok(())
    }
}

names!(SemiImplicitSolve, "solve of the semi-implicit integrator",
    SemiImplicitSolve::Factorisation => "factorisation",
    SemiImplicitSolve::DenseInverse => "dense-inverse");
