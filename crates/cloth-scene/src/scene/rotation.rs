//! Rotations as a person writes them.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A rotation about an axis, counter-clockwise when the axis points at the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SceneRotation {
    /// Direction of the axis, of any length but zero.
    pub axis: [f64; 3],
    /// Angle \[degrees\]; any number of turns.
    pub degrees: f64,
}

impl SceneRotation {
    /// No rotation.
    pub const NONE: Self = Self { axis: [0.0, 0.0, 1.0], degrees: 0.0 };

    /// The rotation of a unit quaternion x, y, z, w.
    #[must_use]
    pub fn from_quaternion(quaternion: [f64; 4]) -> Self {
        let (axis, angle) = DQuat::from_array(quaternion).to_axis_angle();
        Self { axis: axis.into(), degrees: angle.to_degrees() }
    }

    /// The axis with unit length; z where the given one has no direction.
    pub(crate) fn axis_unit(&self) -> DVec3 {
        DVec3::from(self.axis).normalize_or(DVec3::Z)
    }

    /// The same rotation as a unit quaternion.
    pub(crate) fn quaternion(&self) -> DQuat {
        DQuat::from_axis_angle(self.axis_unit(), self.degrees.to_radians())
    }
}
