//! What it takes to go on with a body.

use cloth_core::{ModelError, Pose};

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// Local to world.
    pub pose: Pose,
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: [f64; 3],
    /// Angular velocity \[rad/s\].
    pub angular_velocity: [f64; 3],
}

impl RigidMotion {
    /// Checks that all numbers are finite and the rotation is one.
    ///
    /// # Errors
    /// [`ModelError::NonFinite`] or [`ModelError::OutOfRange`], naming the body of this number.
    pub fn validate(&self, body: usize) -> Result<(), ModelError> {
        let what = || format!("rigid body {body}");
        self.pose.validate(what)?;
        let velocities = [("velocity", self.velocity), ("angular velocity", self.angular_velocity)];
        for (name, velocity) in velocities {
            if let Some(&value) = velocity.iter().find(|component| !component.is_finite()) {
                let what = format!("{name} of {}", what());
                return Err(ModelError::NonFinite { what, value });
            }
        }
        Ok(())
    }
}
