//! One collider, from description to model.

use cloth_core::{Collider, ColliderShape, Pose};
use glam::{DQuat, DVec3};

use crate::{SceneCollider, SceneError, SceneRotation, SceneShape};

use super::{
    Check, CompileOptions, animation, mannequin,
    solid::{self, Plans},
};

pub(super) fn compile(
    check: &Check<'_>,
    index: usize,
    collider: &SceneCollider,
    options: &CompileOptions,
    plans: &mut Plans,
) -> Result<Collider, SceneError> {
    let key = format!("collider[{index}]");
    let name = &collider.name;
    if let Some(rotation) = &collider.rotation {
        rotation_check(check, &format!("{key}.rotation"), rotation)?;
    }
    if let &SceneShape::Plane { normal } = &collider.shape {
        check.direction(&format!("{key}.shape.plane.normal"), normal)?;
    }
    let rotation = collider.rotation.unwrap_or(SceneRotation::NONE).quaternion();
    Ok(Collider {
        name: collider.name.clone(),
        shape: match &collider.shape {
            SceneShape::Plane { .. } => ColliderShape::Plane,
            &SceneShape::Sphere { radius } => ColliderShape::Sphere { radius },
            &SceneShape::Capsule { half_length, radius } => {
                ColliderShape::Capsule { half_length, radius }
            }
            &SceneShape::Box { half_extents } => ColliderShape::Box { half_extents },
            SceneShape::Mesh(mesh) => {
                let key = format!("{key}.shape.mesh");
                let (mesh, cells) = solid::mesh(check, &key, mesh, options)?;
                solid::distances(check, &key, name, (&mesh, cells), plans)?
            }
            SceneShape::Animation(animation) => {
                let key = format!("{key}.shape.animation");
                animation::compile(check, &key, name, animation, options, plans)?
            }
            SceneShape::Mannequin(described) => mannequin::compile(
                check,
                &format!("{key}.shape.mannequin"),
                name,
                described,
                plans,
            )?,
            SceneShape::Tetrahedron { vertices } => {
                let mesh = (&solid::tetrahedron(vertices), solid::CELLS);
                solid::distances(check, &format!("{key}.shape"), name, mesh, plans)?
            }
        },
        pose: Pose {
            translation: collider.translation,
            rotation: (rotation * shape_rotation(&collider.shape)).into(),
        },
        friction: collider.friction,
        restitution: collider.restitution,
    })
}

/// What the shape itself adds to the rotation of a collider: the normal of a plane.
pub(super) fn shape_rotation(shape: &SceneShape) -> DQuat {
    match shape {
        SceneShape::Plane { normal } => {
            DQuat::from_rotation_arc(DVec3::Z, DVec3::from(*normal).normalize_or(DVec3::Z))
        }
        _ => DQuat::IDENTITY,
    }
}

pub(super) fn rotation_check(
    check: &Check<'_>,
    key: &str,
    rotation: &SceneRotation,
) -> Result<(), SceneError> {
    check.direction(&format!("{key}.axis"), rotation.axis)?;
    check.finite(&format!("{key}.degrees"), &[rotation.degrees])
}
