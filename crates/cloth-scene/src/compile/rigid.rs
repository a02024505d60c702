//! Rigid bodies, from description to what moves them and what the cloth feels of them.

use cloth_core::{Collider, ColliderShape, Pose};
use cloth_rigid::{RigidBody, RigidJoint, RigidJointKind, RigidShape, RigidWorld};

use crate::{
    Scene, SceneError, SceneRigid, SceneRigidJoint, SceneRigidJointKind, SceneRigidShape,
    SceneRotation,
};

use super::{Check, collider::rotation_check, solid};

/// The bodies of a scene.
pub(super) struct Bodies {
    pub(super) bodies: Vec<RigidBody>,
    pub(super) joints: Vec<RigidJoint>,
    /// What they are for the cloth.
    pub(super) solids: Vec<Collider>,
}

/// All bodies of a scene, each with the collider that it is for the cloth; `colliders` are those of
/// the scene itself.
pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    colliders: &[Collider],
) -> Result<Bodies, SceneError> {
    let mut bodies = Vec::with_capacity(scene.rigids.len());
    let mut solids = Vec::with_capacity(scene.rigids.len());
    for (index, rigid) in scene.rigids.iter().enumerate() {
        let key = format!("rigid[{index}]");
        let (body, solid) = body(check, &key, rigid)?;
        RigidWorld::new(std::slice::from_ref(&body), &[], scene.gravity)
            .map_err(|error| solid::place(check, &key, &error))?;
        bodies.push(body);
        solids.push(solid);
    }
    if !bodies.is_empty() {
        RigidWorld::new(&bodies, colliders, scene.gravity)
            .map_err(|error| solid::place(check, "collider", &error))?;
    }
    let mut joints = Vec::with_capacity(scene.rigid_joints.len());
    for (index, joint) in scene.rigid_joints.iter().enumerate() {
        let key = format!("rigid_joint[{index}]");
        joints.push(self::joint(scene, check, &key, joint)?);
        RigidWorld::new(&bodies, &[], scene.gravity)
            .and_then(|mut world| world.join(&bodies, &joints))
            .map_err(|error| solid::place(check, &key, &error))?;
    }
    Ok(Bodies { bodies, joints, solids })
}

fn joint(
    scene: &Scene,
    check: &Check<'_>,
    key: &str,
    joint: &SceneRigidJoint,
) -> Result<RigidJoint, SceneError> {
    let wrong = |field: &str, problem: String| SceneError::Value {
        place: check.place(&format!("{key}.{field}")),
        problem,
    };
    let body = |field: &str, name: &str| {
        let found = scene.rigids.iter().position(|rigid| rigid.name == name);
        found.ok_or_else(|| {
            wrong(
                field,
                format!("a joint names the body `{name}`, which does not exist: correct the name"),
            )
        })
    };
    let axis = || {
        let missing = || wrong("axis", "a hinge or slider has no `axis`: add it".to_owned());
        joint.axis.ok_or_else(missing)
    };
    let kind = match joint.kind {
        SceneRigidJointKind::Fixed => RigidJointKind::Fixed,
        SceneRigidJointKind::Ball => RigidJointKind::Ball,
        SceneRigidJointKind::Hinge => RigidJointKind::Hinge {
            axis: axis()?,
            limits: joint.limits.map(|limits| limits.map(f64::to_radians)),
        },
        SceneRigidJointKind::Slider => {
            RigidJointKind::Slider { axis: axis()?, limits: joint.limits }
        }
    };
    if matches!(kind, RigidJointKind::Fixed | RigidJointKind::Ball)
        && (joint.axis.is_some() || joint.limits.is_some())
    {
        let problem = "a fixed or ball joint has no `axis` and no `limits`: remove them";
        return Err(wrong("kind", problem.to_owned()));
    }
    let from = body("from", &joint.from)?;
    let to = joint.to.as_ref().map(|name| body("to", name)).transpose()?;
    Ok(RigidJoint { kind, from, to, anchor: joint.anchor })
}

fn body(
    check: &Check<'_>,
    key: &str,
    rigid: &SceneRigid,
) -> Result<(RigidBody, Collider), SceneError> {
    if let Some(rotation) = &rigid.rotation {
        rotation_check(check, &format!("{key}.rotation"), rotation)?;
    }
    check.positive(&format!("{key}.mass"), rigid.mass)?;
    check.not_negative(&format!("{key}.friction"), rigid.friction)?;
    check.share(&format!("{key}.restitution"), rigid.restitution)?;
    let name = &rigid.name;
    let at = format!("{key}.shape");
    let meshed = |mesh| {
        let shape = solid::distances(check, &at, name, &mesh)?;
        Ok::<_, SceneError>((RigidShape::Mesh(mesh), shape))
    };
    let (shape, solid) = match &rigid.shape {
        &SceneRigidShape::Box { half_extents } => {
            (RigidShape::Box { half_extents }, ColliderShape::Box { half_extents })
        }
        &SceneRigidShape::Sphere { radius } => {
            (RigidShape::Sphere { radius }, ColliderShape::Sphere { radius })
        }
        SceneRigidShape::Mesh(triangles) => meshed(solid::mesh(triangles))?,
        SceneRigidShape::Tetrahedron { vertices } => meshed(solid::tetrahedron(vertices))?,
    };
    let rotation = rigid.rotation.unwrap_or(SceneRotation::NONE).quaternion();
    let pose = Pose { translation: rigid.translation, rotation: rotation.into() };
    let &SceneRigid { friction, restitution, .. } = rigid;
    let collider = Collider { name: name.clone(), shape: solid, pose, friction, restitution };
    let body = RigidBody {
        name: name.clone(),
        shape,
        pose,
        mass: rigid.mass,
        centre_of_mass: rigid.centre_of_mass,
        velocity: rigid.velocity,
        angular_velocity: rigid.angular_velocity,
        force: rigid.force,
        torque: rigid.torque,
        friction,
        restitution,
    };
    Ok((body, collider))
}
