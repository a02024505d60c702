//! Mesh files of a scene: where they may be, and how they are placed.

use std::path::{Component, Path, PathBuf};

use cloth_core::TriangleMesh;
use glam::DVec3;

use crate::{SceneError, SceneMesh, SceneRotation};

use super::{Check, CompileOptions, collider::rotation_check};

/// The mesh at `key`, scaled, rotated and translated.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    mesh: &SceneMesh,
    options: &CompileOptions,
) -> Result<TriangleMesh, SceneError> {
    let place = || check.place(&format!("{key}.file"));
    let path = resolve(&check.origin().directory, &mesh.file, options)
        .ok_or_else(|| SceneError::MeshOutside { place: place(), file: mesh.file.clone() })?;
    let mut read =
        cloth_io::mesh_read(&path).map_err(|source| SceneError::Mesh { place: place(), source })?;
    transform(check, key, (mesh.scale, mesh.rotation, mesh.translation), &mut read)?;
    Ok(read)
}

/// Scales, rotates and translates a mesh.
pub(super) fn transform(
    check: &Check<'_>,
    key: &str,
    (scale, rotation, translation): (f64, Option<SceneRotation>, [f64; 3]),
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    check.positive(&format!("{key}.scale"), scale)?;
    check.finite(&format!("{key}.translation"), &translation)?;
    if let Some(rotation) = &rotation {
        rotation_check(check, &format!("{key}.rotation"), rotation)?;
    }
    let rotation = rotation.map(|rotation| rotation.quaternion());
    for position in &mut mesh.positions {
        let scaled = scale * DVec3::from(*position);
        let turned = rotation.map_or(scaled, |rotation| rotation * scaled);
        *position = (turned + DVec3::from(translation)).into();
    }
    Ok(())
}

/// The path of the mesh `file`, or `None` if the scene may not name it.
pub(super) fn resolve(directory: &Path, file: &str, options: &CompileOptions) -> Option<PathBuf> {
    let path = Path::new(file);
    let is_below = |path: &Path| {
        path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
    };
    if is_below(path) {
        let beside = directory.join(path);
        let elsewhere = options.mesh_roots.iter().map(|root| root.join(path));
        return Some(
            std::iter::once(beside.clone()).chain(elsewhere).find(|p| p.exists()).unwrap_or(beside),
        );
    }
    // A root may be given from the current folder.
    let root_is_above = |root: &Path| path.strip_prefix(root).is_ok_and(is_below);
    let below_root = options.mesh_roots.iter().any(|root| {
        root_is_above(root) || std::path::absolute(root).is_ok_and(|root| root_is_above(&root))
    });
    (below_root || options.mesh_anywhere).then(|| directory.join(path))
}
