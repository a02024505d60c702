//! Solid things that cloth collides with, as signed distances (NUMERICS §7).

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::{BodySurface, DistanceGrid, GridSets};
use crate::{
    ModelError,
    error::{finite_all, in_range, not_negative, positive},
};

/// A kinematic obstacle: rigid, or of a shape that is known for every time.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider {
    /// Name, unique among the colliders of a model.
    pub name: String,
    /// Shape in the local frame.
    pub shape: ColliderShape,
    /// Local to world at the start of the simulation.
    pub pose: Pose,
    /// Coulomb friction coefficient, dimensionless.
    pub friction: f64,
    /// Coefficient of restitution, 0 (no rebound) to 1 (elastic).
    pub restitution: f64,
}

/// Shape of a collider in its local frame.
#[derive(Clone, Debug, PartialEq)]
pub enum ColliderShape {
    /// The half space below the local plane z = 0.
    Plane,
    /// A ball around the local origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// All points within `radius` of the local segment from (0, 0, -half_length) to
    /// (0, 0, half_length).
    Capsule {
        /// Half the length of the segment \[m\].
        half_length: f64,
        /// Radius \[m\].
        radius: f64,
    },
    /// A box around the local origin with faces across the local axes.
    Box {
        /// Half the side lengths \[m\].
        half_extents: [f64; 3],
    },
    /// Any solid, as signed distances on a grid.
    Grid(Arc<DistanceGrid>),
    /// A surface of triangles, open or closed, for contact of triangles alone.
    Surface(Arc<BodySurface>),
}

/// A rigid placement: rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Translation \[m\].
    pub translation: [f64; 3],
    /// Rotation as a unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// No rotation, no translation.
    pub const IDENTITY: Self = Self { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };

    /// A translation \[m\] without rotation.
    #[must_use]
    pub const fn from_translation(translation: [f64; 3]) -> Self {
        Self { translation, rotation: Self::IDENTITY.rotation }
    }

    /// A translation \[m\] and the smallest rotation that takes the local z axis to `direction`
    /// (need not have unit length).
    #[must_use]
    pub fn from_z_axis(translation: [f64; 3], direction: [f64; 3]) -> Self {
        let direction = DVec3::from(direction).normalize_or(DVec3::Z);
        Self { translation, rotation: DQuat::from_rotation_arc(DVec3::Z, direction).into() }
    }

    /// The rotation as a matrix, row by row, local to world.
    #[must_use]
    pub fn rotation_rows(&self) -> [[f64; 3]; 3] {
        DMat3::from_quat(DQuat::from_array(self.rotation)).transpose().to_cols_array_2d()
    }

    /// Where a point of the local frame is in the world \[m\].
    #[must_use]
    pub fn point(&self, local: [f64; 3]) -> [f64; 3] {
        let turned = DMat3::from_quat(DQuat::from_array(self.rotation)) * DVec3::from(local);
        (turned + DVec3::from(self.translation)).into()
    }

    /// The pose on the way from `self` to `other` at `fraction` (0 to 1): translation in a straight
    /// line, rotation at constant angular velocity along the shorter arc.
    #[must_use]
    pub fn interpolate(&self, other: &Self, fraction: f64) -> Self {
        let translation =
            DVec3::from(self.translation).lerp(DVec3::from(other.translation), fraction);
        let rotation =
            DQuat::from_array(self.rotation).slerp(DQuat::from_array(other.rotation), fraction);
        Self { translation: translation.into(), rotation: rotation.into() }
    }

    /// Linear \[m/s\] and angular \[rad/s\] velocity that leads from `self` to `other` in
    /// `duration` \[s\].
    #[must_use]
    pub fn velocities_to(&self, other: &Self, duration: f64) -> ([f64; 3], [f64; 3]) {
        let linear = (DVec3::from(other.translation) - DVec3::from(self.translation)) / duration;
        let mut turn =
            DQuat::from_array(other.rotation) * DQuat::from_array(self.rotation).inverse();
        if turn.w < 0.0 {
            turn = -turn;
        }
        let angular = turn.to_scaled_axis() / duration;
        (linear.into(), angular.into())
    }

    /// Checks that all numbers are finite and the quaternion has unit length (to 1e-6).
    ///
    /// # Errors
    /// [`ModelError::NonFinite`] or [`ModelError::OutOfRange`], naming `what`.
    pub fn validate(&self, what: impl Fn() -> String) -> Result<(), ModelError> {
        finite_all(|| format!("translation of {}", what()), &self.translation)?;
        finite_all(|| format!("rotation of {}", what()), &self.rotation)?;
        in_range(
            || format!("length of the rotation quaternion of {}", what()),
            DQuat::from_array(self.rotation).length(),
            [1.0 - 1e-6, 1.0 + 1e-6],
        )?;
        Ok(())
    }
}

impl ColliderShape {
    /// The samples that hold at `time` \[s\] for a grid, or the sets of a surface, zeros for any other shape.
    #[must_use]
    pub fn sets_at(&self, time: f64) -> GridSets {
        match self {
            Self::Grid(grid) => grid.sets_at(time),
            Self::Surface(surface) => surface.sets_at(time),
            _ => GridSets::default(),
        }
    }

    /// Whether it is not the same at all times.
    #[must_use]
    pub fn changes(&self) -> bool {
        match self {
            Self::Grid(grid) => grid.set_count() > 1,
            Self::Surface(surface) => surface.sets.len() > 1,
            _ => false,
        }
    }
}

impl Collider {
    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        let name = &self.name;
        self.pose.validate(|| format!("collider {name:?}"))?;
        not_negative(|| format!("friction of collider {name:?}"), self.friction)?;
        in_range(|| format!("restitution of collider {name:?}"), self.restitution, [0.0, 1.0])?;
        match &self.shape {
            ColliderShape::Plane => {}
            ColliderShape::Grid(grid) => grid.validate(name)?,
            ColliderShape::Surface(surface) => surface.validate(name)?,
            &ColliderShape::Sphere { radius } => {
                positive(|| format!("radius of collider {name:?}"), radius)?;
            }
            &ColliderShape::Capsule { half_length, radius } => {
                positive(|| format!("radius of collider {name:?}"), radius)?;
                not_negative(|| format!("half length of collider {name:?}"), half_length)?;
            }
            &ColliderShape::Box { half_extents } => {
                for extent in half_extents {
                    positive(|| format!("half extent of collider {name:?}"), extent)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_rows_take_local_z_to_the_axis() {
        let pose = Pose::from_z_axis([0.0; 3], [1.0, 2.0, -2.0]);
        let rows = pose.rotation_rows();
        let z: Vec<f64> = rows.iter().map(|row| row[2]).collect();
        for (found, wanted) in z.iter().zip([1.0 / 3.0, 2.0 / 3.0, -2.0 / 3.0]) {
            assert!((found - wanted).abs() < 1e-12);
        }
        let lifted = Pose { translation: [1.0, 1.0, 1.0], ..pose };
        let [x, y, z] = lifted.point([0.0, 0.0, 3.0]);
        assert!((x - 2.0).hypot(y - 3.0).hypot(z + 1.0) < 1e-12, "{x} {y} {z}");
    }

    #[test]
    fn velocities_lead_to_the_target() {
        let start = Pose::from_translation([1.0, 0.0, 0.0]);
        let end =
            Pose { translation: [1.5, 0.0, 0.0], rotation: DQuat::from_rotation_z(-0.3).into() };
        let (linear, angular) = start.velocities_to(&end, 0.1);
        assert!((linear[0] - 5.0).abs() < 1e-12);
        assert!((angular[2] + 3.0).abs() < 1e-12);
        let half = start.interpolate(&end, 0.5);
        let wanted = DQuat::from_rotation_z(-0.15).to_array();
        for (found, wanted) in half.rotation.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-12);
        }
    }
}
