//! Whether the time step may change.

use crate::{
    ModelError,
    error::{in_range, positive},
};

/// Control of the time step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TimeStepControl {
    /// Every substep has the length of the settings.
    #[default]
    Fixed,
    /// Substeps that go wrong are done again with half the length.
    Adaptive(AdaptiveSettings),
}

/// Settings of the adaptive time step.
///
/// A substep fails if its linear solve breaks down or, where that counts, misses its tolerance, if that is not zero, if a
/// number is not finite, if bodies pinch cloth, or if a spring ends longer than allowed. It is then taken back, and the rest
/// of the frame goes on with half the length. After some good ones in a row the length doubles again,
/// up to that of the settings. The length at present is part of the state.
///
/// Every substep is measured: a pass over the springs, which an explicit step takes hardly longer
/// for, and which is lost in an implicit one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSettings {
    /// Largest relative elongation of a spring that a substep may end with.
    pub strain_max: f64,
    /// Times that the length may be halved, at most 20. A substep that fails at the shortest length
    /// stands, unless the linear solve broke down or a number is not finite: that is a divergence.
    pub halvings_max: u32,
    /// Good substeps in a row after which the length doubles.
    pub grow_after: u32,
    /// Whether a linear solve that misses its tolerance is a failure.
    pub needs_convergence: bool,
}

impl Default for AdaptiveSettings {
    fn default() -> Self {
        Self { strain_max: 0.5, halvings_max: 8, grow_after: 4, needs_convergence: true }
    }
}

impl TimeStepControl {
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        let Self::Adaptive(settings) = self else { return Ok(()) };
        positive(|| "largest strain of the adaptive time step".into(), settings.strain_max)?;
        in_range(
            || "halvings of the adaptive time step".into(),
            f64::from(settings.halvings_max),
            [0.0, 20.0],
        )?;
        positive(
            || "substeps before the adaptive time step grows".into(),
            f64::from(settings.grow_after),
        )?;
        Ok(())
    }
}
