//! Rigid bodies, from description to what moves them and what the cloth feels of them.

use cloth_core::{Collider, ColliderShape, Pose};
use cloth_rigid::{RigidBody, RigidShape, RigidWorld};

use crate::{Scene, SceneError, SceneRigid, SceneRigidShape, SceneRotation};

use super::{Check, collider::rotation_check, solid};

/// All bodies of a scene, each with the collider that it is for the cloth; `colliders` are those of
/// the scene itself.
pub(super) fn compile(
    scene: &Scene,
    check: &Check<'_>,
    colliders: &[Collider],
) -> Result<(Vec<RigidBody>, Vec<Collider>), SceneError> {
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
    Ok((bodies, solids))
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
