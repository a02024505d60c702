//! What it takes to go on with a body in another world.

use cloth_core::Pose;

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
