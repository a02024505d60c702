//! Bodies, from what a scene says to what rapier wants.

use cloth_core::{BodySurface, Pose, TriangleMesh};
use rapier3d_f64::{
    math::{Pose as RapierPose, Rotation},
    parry::{
        mass_properties::MassProperties,
        transformation::vhacd::{VHACD, VHACDParameters},
    },
    prelude::{ColliderBuilder, SharedShape},
};

use crate::{
    RigidError,
    mesh::{closed, is_convex, vector},
    world::{ROTATION_MAX, SPEED_MAX, STEP_MAX},
};

/// A rigid body at the start of a simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidBody {
    /// Name, for messages.
    pub name: String,
    /// Shape in the local frame.
    pub shape: RigidShape,
    /// Local to world.
    pub pose: Pose,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the local frame \[m\]; that of the evenly filled shape if `None`. The moments
    /// of inertia are always those of the evenly filled shape.
    pub centre_of_mass: Option<[f64; 3]>,
    /// Velocity of the centre of mass \[m/s\].
    pub velocity: [f64; 3],
    /// Angular velocity \[rad/s\].
    pub angular_velocity: [f64; 3],
    /// Constant force on the centre of mass, beside gravity \[N\].
    pub force: [f64; 3],
    /// Constant torque \[N m\].
    pub torque: [f64; 3],
    /// Coulomb friction coefficient, dimensionless.
    pub friction: f64,
    /// Coefficient of restitution, 0 (no rebound) to 1 (elastic).
    pub restitution: f64,
}

/// Shape of a body in its local frame.
#[derive(Clone, Debug, PartialEq)]
pub enum RigidShape {
    /// A box around the local origin with faces across the local axes.
    Box {
        /// Half the side lengths \[m\].
        half_extents: [f64; 3],
    },
    /// A ball around the local origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// All points within `radius` of a segment of the local z axis, centred on the origin.
    Capsule {
        /// Half the length of the segment \[m\].
        half_length: f64,
        /// Radius \[m\].
        radius: f64,
    },
    /// A closed triangle mesh.
    Mesh(Box<TriangleMesh>),
}

pub(crate) fn pose(pose: &Pose) -> RapierPose {
    let [x, y, z, w] = pose.rotation;
    RapierPose::from_parts(vector(pose.translation), Rotation::from_xyzw(x, y, z, w))
}

/// Largest coordinate \[m\] of a body or collider that rigid bodies meet: parry looks for contact with squares and cubes of these, and its
/// searches do not end where they overflow.
const REACH_MAX: f64 = 1e6;

/// The collider, if its shape and place are such that contact with it can be computed.
pub(crate) fn within_reach(
    name: &str,
    collider: ColliderBuilder,
    pose: &Pose,
) -> Result<ColliderBuilder, RigidError> {
    let bounds = collider.shape.compute_local_aabb();
    let corners = [bounds.mins, bounds.maxs].map(|corner| [corner.x, corner.y, corner.z]);
    let coordinates = corners.into_iter().flatten().chain(pose.translation);
    match coordinates.map(f64::abs).find(|value| value.is_nan() || *value > REACH_MAX) {
        Some(value) => Err(RigidError::TooLarge { name: name.to_owned(), value, limit: REACH_MAX }),
        None => Ok(collider),
    }
}

impl RigidBody {
    /// Checks the numbers.
    pub(crate) fn validate(&self) -> Result<(), RigidError> {
        let error = |what, value, positive| RigidError::Number {
            name: self.name.clone(),
            what,
            value,
            positive,
        };
        let positive = [("the mass", self.mass)];
        let sizes: Vec<(&'static str, f64)> = match &self.shape {
            RigidShape::Box { half_extents } => {
                half_extents.iter().map(|&extent| ("a half extent", extent)).collect()
            }
            RigidShape::Sphere { radius } => vec![("the radius", *radius)],
            RigidShape::Capsule { half_length, radius } => {
                vec![("half the length", *half_length), ("the radius", *radius)]
            }
            RigidShape::Mesh(_) => Vec::new(),
        };
        for (what, value) in positive.into_iter().chain(sizes) {
            if !(value > 0.0 && value.is_finite()) {
                return Err(error(what, value, true));
            }
        }
        let vectors = [
            ("the place", self.pose.translation),
            ("the centre of mass", self.centre_of_mass.unwrap_or_default()),
            ("the velocity", self.velocity),
            ("the angular velocity", self.angular_velocity),
            ("the force", self.force),
            ("the torque", self.torque),
            ("friction or restitution", [self.friction, self.restitution, 0.0]),
        ];
        for (what, vector) in vectors {
            if let Some(&value) = vector.iter().find(|value| !value.is_finite()) {
                return Err(error(what, value, false));
            }
        }
        let length = |vector: [f64; 3]| vector.iter().map(|c| c * c).sum::<f64>().sqrt();
        let turning = ROTATION_MAX / STEP_MAX;
        for (what, value, limit) in [
            ("the velocity", length(self.velocity), SPEED_MAX),
            ("the angular velocity", length(self.angular_velocity), turning),
        ] {
            if value > limit {
                return Err(RigidError::TooFast { name: self.name.clone(), what, value, limit });
            }
        }
        Ok(())
    }

    /// Shape and mass.
    pub(crate) fn build(&self) -> Result<(ColliderBuilder, MassProperties), RigidError> {
        let (collider, mut properties) = match &self.shape {
            RigidShape::Box { half_extents } => {
                let [x, y, z] = *half_extents;
                let properties = MassProperties::from_cuboid(1.0, vector(*half_extents));
                (ColliderBuilder::cuboid(x, y, z), properties)
            }
            RigidShape::Sphere { radius } => {
                (ColliderBuilder::ball(*radius), MassProperties::from_ball(1.0, *radius))
            }
            RigidShape::Capsule { half_length, radius } => {
                let end = vector([0.0, 0.0, *half_length]);
                let properties = MassProperties::from_capsule(1.0, -end, end, *radius);
                (ColliderBuilder::capsule_z(*half_length, *radius), properties)
            }
            RigidShape::Mesh(mesh) => {
                let triangles = closed(&self.name, mesh)?;
                let vertices: Vec<_> = mesh.positions.iter().copied().map(vector).collect();
                let properties = MassProperties::from_trimesh(1.0, &vertices, &triangles);
                (solid(&self.name, mesh, &triangles)?, properties)
            }
        };
        properties.set_mass(self.mass, true);
        if let Some(centre) = self.centre_of_mass {
            properties.local_com = vector(centre);
        }
        Ok((collider.density(0.0), properties))
    }
}

/// A surface that bodies collide with: a solid if it is closed, else its triangles from both sides.
pub(crate) fn surface(name: &str, surface: &BodySurface) -> Result<ColliderBuilder, RigidError> {
    let positions = surface.sets.first().cloned().unwrap_or_default();
    let triangles = surface.triangles.clone();
    let mesh = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
    if let Ok(triangles) = closed(name, &mesh) {
        return solid(name, &mesh, &triangles);
    }
    let vertices = mesh.positions.iter().copied().map(vector).collect();
    let error = || RigidError::Shape { name: name.into(), problem: "it has no triangles".into() };
    // The library gives up on some meshes by a panic.
    let built = std::panic::catch_unwind(|| ColliderBuilder::trimesh(vertices, mesh.triangles));
    built.ok().and_then(Result::ok).ok_or_else(error)
}

/// A solid: its hull if it is convex, else the convex parts that it is divided into.
pub(crate) fn solid(
    name: &str,
    mesh: &TriangleMesh,
    triangles: &[[u32; 3]],
) -> Result<ColliderBuilder, RigidError> {
    let vertices: Vec<_> = mesh.positions.iter().copied().map(vector).collect();
    let error = |problem: &str| RigidError::Shape { name: name.into(), problem: problem.into() };
    // The library gives up on points that are all but flat, or far apart, by a panic.
    if is_convex(&mesh.positions, triangles) {
        let hull = std::panic::catch_unwind(|| ColliderBuilder::convex_hull(&vertices));
        return hull.ok().flatten().ok_or_else(|| error("it has no convex hull"));
    }
    let parts = std::panic::catch_unwind(|| {
        let division = VHACD::decompose(&VHACDParameters::default(), &vertices, triangles, true);
        let hulls = division.compute_exact_convex_hulls(&vertices, triangles).into_iter();
        hulls
            .filter_map(|(vertices, triangles)| SharedShape::convex_mesh(vertices, &triangles))
            .map(|part| (RapierPose::IDENTITY, part))
            .collect::<Vec<_>>()
    });
    match parts {
        Ok(parts) if !parts.is_empty() => Ok(ColliderBuilder::compound(parts)),
        _ => Err(error("it cannot be divided into convex parts")),
    }
}
