//! Settings of the strain limit.

use crate::{
    ModelError, SpringClass,
    error::{in_range, positive},
};

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

impl StrainLimit {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        in_range(|| "ratio of the strain limit".into(), self.ratio, [1.0, 1e6])?;
        positive(|| "sweeps of the strain limit".into(), f64::from(self.sweeps))?;
        Ok(())
    }
}
