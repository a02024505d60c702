//! Joints between bodies.

use cloth_core::Pose;
use rapier3d_f64::{
    math::Rotation,
    prelude::{GenericJoint, JointAxesMask, JointAxis},
};

use crate::{RigidBody, RigidError, mesh::vector, shape::pose};

/// A constraint between two bodies, as they are at the start. The two do not collide with each other.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidJoint {
    /// What it leaves free.
    pub kind: RigidJointKind,
    /// Index of a body.
    pub from: usize,
    /// Index of the other one; `None` for the world.
    pub to: Option<usize>,
    /// Where they are joined, in the world at the start \[m\].
    pub anchor: [f64; 3],
}

/// What a joint leaves free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigidJointKind {
    /// Nothing.
    Fixed,
    /// All rotations about the anchor.
    Ball,
    /// The rotation about an axis through the anchor.
    Hinge {
        /// The axis in the world at the start, of any length but zero.
        axis: [f64; 3],
        /// Least and largest angle by which `from` is turned against `to` \[rad\].
        limits: Option<[f64; 2]>,
    },
    /// The motion along an axis.
    Slider {
        /// The axis in the world at the start, of any length but zero.
        axis: [f64; 3],
        /// Least and largest way of `from` along it, seen from `to` \[m\].
        limits: Option<[f64; 2]>,
    },
}

impl RigidJoint {
    /// The joint number `index` of `bodies`, as the library has it.
    pub(crate) fn build(
        &self,
        index: usize,
        bodies: &[RigidBody],
    ) -> Result<GenericJoint, RigidError> {
        let count = bodies.len();
        let exists = |body: usize| body < count;
        if !exists(self.from) || !self.to.is_none_or(exists) || self.to == Some(self.from) {
            return Err(RigidError::Joint { joint: index, problem: "it does not join two bodies" });
        }
        let (locked, axis, limits) = match self.kind {
            RigidJointKind::Fixed => (JointAxesMask::LOCKED_FIXED_AXES, [1.0, 0.0, 0.0], None),
            RigidJointKind::Ball => (JointAxesMask::LOCKED_SPHERICAL_AXES, [1.0, 0.0, 0.0], None),
            RigidJointKind::Hinge { axis, limits } => {
                let limits = limits.map(|limits| (JointAxis::AngX, limits));
                (JointAxesMask::LOCKED_REVOLUTE_AXES, axis, limits)
            }
            RigidJointKind::Slider { axis, limits } => {
                let limits = limits.map(|limits| (JointAxis::LinX, limits));
                (JointAxesMask::LOCKED_PRISMATIC_AXES, axis, limits)
            }
        };
        let length = axis.iter().map(|component| component * component).sum::<f64>().sqrt();
        let finite =
            length.is_finite() && self.anchor.iter().all(|component| component.is_finite());
        if !(length > 0.0 && finite) {
            let problem = "its anchor and axis must be finite, the axis not zero";
            return Err(RigidError::Joint { joint: index, problem });
        }
        if limits
            .is_some_and(|(_, [low, high])| !(low <= high && low.is_finite() && high.is_finite()))
        {
            let problem = "its limits must be finite, the lower one first";
            return Err(RigidError::Joint { joint: index, problem });
        }
        let rotation =
            Rotation::from_rotation_arc(vector([1.0, 0.0, 0.0]), vector(axis.map(|c| c / length)));
        let frame = Pose { translation: self.anchor, rotation: rotation.to_array() };
        let local = |body: Option<usize>| match body {
            Some(body) => pose(&bodies[body].pose).inverse() * pose(&frame),
            None => pose(&frame),
        };
        let mut joint = GenericJoint::new(locked);
        joint.set_local_frame1(local(self.to));
        joint.set_local_frame2(local(Some(self.from)));
        joint.set_contacts_enabled(false);
        if let Some((axis, limits)) = limits {
            joint.set_limits(axis, limits);
        }
        Ok(joint)
    }
}
