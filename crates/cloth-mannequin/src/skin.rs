//! How vertices follow the joints.
//!
//! To each joint each vertex has a weight: 1 beyond it, 0 on this side, and smoothly in between. It turns about the joint by that share of the
//! rotation, joints farther out first. This is spherical blend skinning (Kavan and Žára 2005) with the joint as centre: unlike blended matrices it
//! does not make limbs thinner where they bend.

use glam::{DQuat, DVec3};

use crate::{
    body::{Body, Distances, Joints},
    pose::{Pose, Swing},
    stack::smooth_step,
};

/// Elbows, shoulders, knees, hips, each left and right, and the neck: what is farther out comes first.
const JOINTS: usize = 9;

#[derive(Clone, Debug)]
pub(crate) struct Skin {
    weights: Vec<[f64; JOINTS]>,
    centres: [DVec3; JOINTS],
    /// Direction of the left arm at rest.
    arm: DVec3,
}

impl Skin {
    pub(crate) fn new(body: &Body, positions: &[DVec3]) -> Self {
        let Joints { shoulder, elbow, hip, knee, neck, arm } = body.joints;
        let pairs = [elbow, shoulder, knee, hip].map(|left| [left, mirrored(left)]);
        let mut centres = [neck; JOINTS];
        for (centre, pair) in centres.iter_mut().zip(pairs.iter().flatten()) {
            *centre = *pair;
        }
        let weights = positions.iter().map(|&at| weights(body, at)).collect();
        Self { weights, centres, arm }
    }

    /// The rotation of each joint from rest to a pose.
    pub(crate) fn rotations(&self, pose: &Pose) -> [DQuat; JOINTS] {
        let arms = [self.arm, mirrored(self.arm)];
        let side = |k: usize| if k == 0 { 1.0 } else { -1.0 };
        // Elbows bend to the front of the arm at rest, knees to the back.
        let elbow = |k: usize| {
            let axis = arms[k].cross(DVec3::NEG_Y).normalize_or(DVec3::X);
            DQuat::from_axis_angle(axis, pose.elbows[k].to_radians())
        };
        let shoulder =
            |k: usize| DQuat::from_rotation_arc(arms[k], direction(pose.shoulders[k], side(k)));
        let knee = |k: usize| DQuat::from_rotation_x(pose.knees[k].to_radians());
        let hip =
            |k: usize| DQuat::from_rotation_arc(DVec3::NEG_Z, direction(pose.hips[k], side(k)));
        let head = DQuat::from_rotation_z(pose.head.to_radians());
        [elbow(0), elbow(1), shoulder(0), shoulder(1), knee(0), knee(1), hip(0), hip(1), head]
    }

    /// Where a vertex goes that is at `at` in rest.
    pub(crate) fn posed(&self, vertex: usize, at: DVec3, rotations: &[DQuat; JOINTS]) -> DVec3 {
        let Some(weights) = self.weights.get(vertex) else { return at };
        let joints = weights.iter().zip(&self.centres).zip(rotations);
        joints.fold(at, |at, ((&weight, &centre), &rotation)| {
            if weight == 0.0 {
                return at;
            }
            centre + DQuat::IDENTITY.slerp(rotation, weight) * (at - centre)
        })
    }
}

fn mirrored(at: DVec3) -> DVec3 {
    DVec3::new(-at.x, at.y, at.z)
}

/// A unit vector; `side` is 1 for the left and -1 for the right.
fn direction(swing: Swing, side: f64) -> DVec3 {
    let (out, down) = swing.raise.to_radians().sin_cos();
    let (front, aside) = swing.forwards.to_radians().sin_cos();
    DVec3::new(side * out * aside, -out * front, -down)
}

/// The weights of a point: by how far it is from the parts on both sides of a joint, or along the limb.
fn weights(body: &Body, at: DVec3) -> [f64; JOINTS] {
    let h = body.height;
    let Distances { trunk, arms, legs, .. } = body.distances(at);
    let Joints { elbow, knee, neck, arm, .. } = body.joints;
    let sides = [at, mirrored(at)];
    // Far from a limb its distance says little.
    let near = |limb: f64| smooth_step((0.065 * h - limb) / (0.04 * h));
    let shoulder = [0, 1].map(|k| near(arms[k]) * smooth_step((trunk - arms[k]) / (0.09 * h)));
    let hip = [0, 1].map(|k| {
        let own = near(legs[k]) * smooth_step((trunk - legs[k]) / (0.08 * h));
        own * smooth_step((legs[1 - k] - legs[k]) / (0.02 * h) + 0.5)
    });
    let bent = [0, 1].map(|k| shoulder[k] * smooth_step((sides[k] - elbow).dot(arm) / (0.07 * h)));
    let knees = [0, 1].map(|k| hip[k] * smooth_step((knee.z - at.z) / (0.08 * h)));
    let head = smooth_step((at.z - neck.z) / (0.06 * h));
    [bent[0], bent[1], shoulder[0], shoulder[1], knees[0], knees[1], hip[0], hip[1], head]
}
