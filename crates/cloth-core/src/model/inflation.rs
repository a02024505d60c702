//! Gas under pressure within a closed cloth (NUMERICS §3).

use super::Model;
use crate::{
    Error, ModelError,
    error::{finite_all, not_negative},
};

/// Pressure of the gas inside a cloth, above that outside. Inside is where the triangles do not face.
#[derive(Clone, Debug, PartialEq)]
pub struct Inflation {
    /// Name of the cloth.
    pub cloth: String,
    /// The pressure \[Pa\] once it is there; below zero to suck the cloth in.
    pub pressure: f64,
    /// When it begins to rise from zero, and when it is there \[s\].
    pub rise: [f64; 2],
}

impl Inflation {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        let of = |what: &str| format!("{what} of the inflation of cloth {:?}", self.cloth);
        finite_all(|| of("pressure"), &[self.pressure])?;
        not_negative(|| of("start"), self.rise[0])?;
        not_negative(|| of("time to rise"), self.rise[1] - self.rise[0]).map(|_| ())
    }

    /// The pressure \[Pa\] at `time` \[s\].
    #[must_use]
    pub fn at(&self, time: f64) -> f64 {
        let [start, end] = self.rise;
        if time >= end {
            self.pressure
        } else if time <= start {
            0.0
        } else {
            self.pressure * ((time - start) / (end - start))
        }
    }
}

impl Model {
    /// What inflates each cloth, by the number of the cloth.
    #[must_use]
    pub fn inflation(&self, cloth: usize) -> Option<&Inflation> {
        let name = &self.cloths.get(cloth)?.name;
        self.inflations.iter().find(|inflation| inflation.cloth == *name)
    }

    /// Checks, for a backend without it, that no cloth is inflated.
    ///
    /// # Errors
    /// `Unsupported`, with the backends that have it.
    pub fn check_no_inflation(&self, backend: &'static str) -> Result<(), Error> {
        if self.inflations.is_empty() {
            return Ok(());
        }
        let feature = "gas under pressure in a cloth (the backends cpu and reference do)".into();
        Err(Error::Unsupported { backend, feature })
    }
}
