//! Gas under pressure within a closed cloth (NUMERICS §3).

use super::Model;
use crate::{
    ModelError, Real,
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

    /// The share of the pressure at `time` \[s\], computed as solvers of this precision do.
    #[must_use]
    pub fn share<T: Real>(&self, time: T) -> T {
        let [start, end] = self.rise.map(T::from_f64);
        if time >= end {
            T::ONE
        } else if time <= start {
            T::ZERO
        } else {
            (time - start) / (end - start)
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

    /// For each cloth a sixth of the pressure \[Pa\] within, when it begins to rise and when it is there \[s\]: zeros where there is no gas.
    #[must_use]
    pub fn gas_table(&self) -> Vec<[f64; 3]> {
        let of = |inflation: &Inflation| {
            [inflation.pressure / 6.0, inflation.rise[0], inflation.rise[1]]
        };
        let numbers = 0..self.cloths.len();
        numbers.map(|number| self.inflation(number).map_or([0.0; 3], of)).collect()
    }

    /// Whether gas is under pressure in some cloth.
    #[must_use]
    pub fn has_inflation(&self) -> bool {
        !self.inflations.is_empty()
    }
}
