//! Colliders and rigid bodies beside the cloth.

use std::fmt;
use std::sync::Arc;

use cloth_core::{Collider, ColliderShape, GridSets, Pose};
use glam::{DQuat, DVec3};

use crate::picture::{PictureShape, Tessellation};

/// Where all colliders of a run are at a time \[s\], in their order.
type Poses = Arc<dyn Fn(f64) -> Vec<Pose> + Send + Sync>;

/// The colliders of a run, rigid bodies among them, as triangles that formats of frames can hold.
#[derive(Clone)]
pub struct FrameSolids {
    solids: Arc<[Solid]>,
    poses: Poses,
}

/// A solid where it is at one time.
pub(crate) struct PlacedSolid<'a> {
    pub(super) name: &'a str,
    /// Positions \[m\].
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: &'a [[u32; 3]],
}

/// One collider in its own frame.
pub(super) struct Solid {
    pub(super) name: String,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Positions \[m\] at the start of the simulation.
    positions: Vec<[f64; 3]>,
    /// The same for every time, if the shape changes.
    changing: Option<ColliderShape>,
}

impl FrameSolids {
    /// The `colliders` of a model, at the `poses` that a function gives for all of them and any time
    /// \[s\]. Planes, which have no end, become squares around `cloth`, the particles at the start \[m\].
    #[must_use]
    pub fn new(
        colliders: &[Collider],
        cloth: &[[f64; 3]],
        poses: impl Fn(f64) -> Vec<Pose> + Send + Sync + 'static,
    ) -> Self {
        let solids = colliders.iter().map(|collider| Solid::new(collider, cloth)).collect();
        Self { solids, poses: Arc::new(poses) }
    }

    pub(super) fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// Where the solids are at `time` \[s\].
    pub(super) fn poses_at(&self, time: f64) -> Vec<Pose> {
        (self.poses)(time)
    }

    /// The solids in the world at `time` \[s\].
    pub(super) fn at(&self, time: f64) -> Vec<PlacedSolid<'_>> {
        let solids = self.solids.iter().zip(self.poses_at(time));
        solids
            .map(|(solid, pose)| {
                let rotation = DQuat::from_array(pose.rotation);
                let place = |position: [f64; 3]| {
                    (rotation * DVec3::from(position) + DVec3::from(pose.translation)).to_array()
                };
                PlacedSolid {
                    name: &solid.name,
                    positions: solid.positions_at(time).into_iter().map(place).collect(),
                    triangles: &solid.triangles,
                }
            })
            .collect()
    }
}

impl fmt::Debug for FrameSolids {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.solids.iter().map(|solid| &solid.name);
        formatter.debug_list().entries(names).finish()
    }
}

impl Solid {
    fn new(collider: &Collider, cloth: &[[f64; 3]]) -> Self {
        let origin = [0.0; 3];
        let shape = match collider.shape {
            ColliderShape::Plane => return Self::plane(collider, cloth),
            // Those of balls and capsules, too, are the triangles that cloth touches: rounder ones would show through it.
            ColliderShape::Grid(_)
            | ColliderShape::Surface(_)
            | ColliderShape::Sphere { .. }
            | ColliderShape::Capsule { .. } => return Self::mesh(collider),
            ColliderShape::Box { half_extents } => PictureShape::Cuboid {
                center: origin,
                rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                half_extents,
            },
        };
        let Tessellation { positions, triangles, .. } = Tessellation::of(&shape);
        Self { name: collider.name.clone(), triangles, positions, changing: None }
    }

    fn mesh(Collider { name, shape, .. }: &Collider) -> Self {
        Self {
            name: name.clone(),
            triangles: shape.body_triangles().unwrap_or_default().to_vec(),
            positions: shape.body_positions(GridSets::default()).into_owned(),
            changing: shape.changes().then(|| shape.clone()),
        }
    }

    /// A square below the cloth, twice as far in each direction as the cloth reaches or could fall.
    fn plane(collider: &Collider, cloth: &[[f64; 3]]) -> Self {
        let to_local = DQuat::from_array(collider.pose.rotation).inverse();
        let local = |position: &[f64; 3]| {
            to_local * (DVec3::from(*position) - DVec3::from(collider.pose.translation))
        };
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for position in cloth.iter().map(local) {
            (min, max) = (min.min(position), max.max(position));
        }
        let (middle, half) = if min.is_finite() {
            (0.5 * (min + max), 0.5 * (max - min).max_element() + max.z.abs())
        } else {
            (DVec3::ZERO, 1.0)
        };
        let reach = 2.0 * half.max(0.1);
        let corner = |x: f64, y: f64| [middle.x + x * reach, middle.y + y * reach, 0.0];
        Self {
            name: collider.name.clone(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            positions: vec![
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ],
            changing: None,
        }
    }

    /// Whether the shape changes with time.
    pub(super) fn changes(&self) -> bool {
        self.changing.is_some()
    }

    /// Positions \[m\] in the frame of the collider at `time` \[s\].
    pub(super) fn positions_at(&self, time: f64) -> Vec<[f64; 3]> {
        match &self.changing {
            Some(shape) => shape.body_positions(shape.sets_at(time)).into_owned(),
            None => self.positions.clone(),
        }
    }
}
