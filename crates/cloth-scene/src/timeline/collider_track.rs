//! The way of one collider.

use cloth_core::Pose;
use glam::{DQuat, DVec3};

use crate::SceneRotation;

use super::FrameSpan;

/// Cosine of the angle between two axes above which they are the same.
const SAME_AXIS: f64 = 1.0 - 1e-12;

/// A collider that moves.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ColliderTrack {
    /// Index into the colliders of the model.
    pub(crate) collider: u32,
    /// Rotation that belongs to the shape, before that of the keyframes.
    pub(crate) shape_rotation: DQuat,
    /// At least one key, the first at time zero; times ascending.
    pub(crate) keys: Vec<ColliderKey>,
}

/// Where a collider is at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ColliderKey {
    /// Time \[s\].
    pub(crate) time: f64,
    /// Translation \[m\].
    pub(crate) translation: [f64; 3],
    /// Rotation, as written: the number of turns matters.
    pub(crate) rotation: SceneRotation,
}

impl ColliderTrack {
    /// Whether the collider moves in a frame.
    pub(crate) fn moves_in(&self, span: &FrameSpan) -> bool {
        self.keys.windows(2).any(|pair| {
            span.overlaps(pair[0].time, pair[1].time)
                && (pair[0].translation != pair[1].translation
                    || pair[0].rotation != pair[1].rotation)
        })
    }

    /// The pose at `time` \[s\].
    pub(crate) fn pose(&self, time: f64) -> Pose {
        let next = self.keys.partition_point(|key| key.time <= time);
        let before = self.keys.get(next.saturating_sub(1));
        let (translation, rotation) = match (before, self.keys.get(next)) {
            (Some(before), Some(after)) => before.towards(after, time),
            (Some(last), None) => (DVec3::from(last.translation), last.rotation.quaternion()),
            _ => (DVec3::ZERO, DQuat::IDENTITY),
        };
        Pose {
            translation: translation.into(),
            // Products of unit quaternions drift off unit length by rounding.
            rotation: (rotation * self.shape_rotation).normalize().into(),
        }
    }
}

impl ColliderKey {
    fn towards(&self, after: &Self, time: f64) -> (DVec3, DQuat) {
        let fraction = (time - self.time) / (after.time - self.time);
        let translation =
            DVec3::from(self.translation).lerp(DVec3::from(after.translation), fraction);
        (translation, rotation_between(&self.rotation, &after.rotation, fraction))
    }
}

/// The rotation on the way from `from` to `to` at `fraction` (0 to 1).
fn rotation_between(from: &SceneRotation, to: &SceneRotation, fraction: f64) -> DQuat {
    // No rotation at all has the axis of the other one.
    let axis = if from.degrees == 0.0 { to.axis_unit() } else { from.axis_unit() };
    let same = to.degrees == 0.0 || axis.dot(to.axis_unit()) > SAME_AXIS;
    if same {
        let degrees = from.degrees + fraction * (to.degrees - from.degrees);
        DQuat::from_axis_angle(axis, degrees.to_radians())
    } else {
        from.quaternion().slerp(to.quaternion(), fraction)
    }
}
