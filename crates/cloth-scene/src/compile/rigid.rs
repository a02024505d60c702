//! Rigid bodies, from description to what moves them and what the cloth feels of them.

use std::collections::HashMap;

use cloth_core::{Collider, ColliderShape, Pose};
use cloth_rigid::{RigidBody, RigidError, RigidJoint, RigidJointKind, RigidShape, RigidWorld};

use crate::{
    Scene, SceneError, SceneRigid, SceneRigidJoint, SceneRigidJointKind, SceneRigidShape,
    SceneRotation,
};

use super::{
    Check, CompileOptions,
    collider::rotation_check,
    solid::{self, Plans},
};

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
    options: &CompileOptions,
    plans: &mut Plans,
) -> Result<Bodies, SceneError> {
    let mut bodies = Vec::with_capacity(scene.rigids.len());
    let mut solids = Vec::with_capacity(scene.rigids.len());
    for (index, rigid) in scene.rigids.iter().enumerate() {
        let key = format!("rigid[{index}]");
        let (body, solid) = body(check, &key, rigid, options, plans)?;
        RigidWorld::new(std::slice::from_ref(&body), &[], scene.gravity)
            .map_err(|error| solid::place(check, &key, &error))?;
        bodies.push(body);
        solids.push(solid);
    }
    let mut joints = Vec::with_capacity(scene.rigid_joints.len());
    let numbers = scene.rigids.iter().enumerate();
    // Of two bodies of one name the first is meant; the model refuses them later on.
    let numbers = numbers.rev().map(|(number, rigid)| (rigid.name.as_str(), number)).collect();
    for (index, joint) in scene.rigid_joints.iter().enumerate() {
        let key = format!("rigid_joint[{index}]");
        joints.push(self::joint(&numbers, check, &key, joint)?);
    }
    if !bodies.is_empty() {
        let mut world = RigidWorld::new(&bodies, colliders, scene.gravity)
            .map_err(|error| solid::place(check, "collider", &error))?;
        world.join(&bodies, &joints).map_err(|error| {
            let key = match &error {
                RigidError::Joint { joint, .. } => format!("rigid_joint[{joint}]"),
                _ => "rigid_joint".to_owned(),
            };
            solid::place(check, &key, &error)
        })?;
    }
    Ok(Bodies { bodies, joints, solids })
}

/// `numbers` are those of the bodies by name.
fn joint(
    numbers: &HashMap<&str, usize>,
    check: &Check<'_>,
    key: &str,
    joint: &SceneRigidJoint,
) -> Result<RigidJoint, SceneError> {
    let wrong = |field: &str, problem: String| SceneError::Value {
        place: check.place(&format!("{key}.{field}")),
        problem,
    };
    let body = |field: &str, name: &str| {
        numbers.get(name).copied().ok_or_else(|| {
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
    options: &CompileOptions,
    plans: &mut Plans,
) -> Result<(RigidBody, Collider), SceneError> {
    if let Some(rotation) = &rigid.rotation {
        rotation_check(check, &format!("{key}.rotation"), rotation)?;
    }
    check.positive(&format!("{key}.mass"), rigid.mass)?;
    check.not_negative(&format!("{key}.friction"), rigid.friction)?;
    check.share(&format!("{key}.restitution"), rigid.restitution)?;
    let name = &rigid.name;
    let at = format!("{key}.shape");
    let mut meshed = |at: &str, mesh, cells| {
        let shape = solid::distances(check, at, name, (&mesh, cells), plans)?;
        Ok::<_, SceneError>((RigidShape::Mesh(Box::new(mesh)), shape))
    };
    let (shape, solid) = match &rigid.shape {
        &SceneRigidShape::Box { half_extents } => {
            (RigidShape::Box { half_extents }, ColliderShape::Box { half_extents })
        }
        &SceneRigidShape::Sphere { radius } => {
            (RigidShape::Sphere { radius }, ColliderShape::Sphere { radius })
        }
        &SceneRigidShape::Capsule { half_length, radius } => (
            RigidShape::Capsule { half_length, radius },
            ColliderShape::Capsule { half_length, radius },
        ),
        SceneRigidShape::Mesh(mesh) => {
            let at = format!("{at}.mesh");
            let (mesh, cells) = solid::mesh(check, &at, mesh, options)?;
            meshed(&at, mesh, cells)?
        }
        SceneRigidShape::Tetrahedron { vertices } => {
            meshed(&at, solid::tetrahedron(vertices), solid::CELLS)?
        }
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
