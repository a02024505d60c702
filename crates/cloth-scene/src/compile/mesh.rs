//! Mesh files of a scene: where they may be, and how they are placed.

use std::path::{Component, Path, PathBuf};

use cloth_core::TriangleMesh;
use glam::DVec3;

use crate::{SceneError, SceneMesh};

use super::{Check, CompileOptions};

/// The mesh at `key`, scaled, rotated and translated.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    mesh: &SceneMesh,
    options: &CompileOptions,
) -> Result<TriangleMesh, SceneError> {
    check.positive(&format!("{key}.scale"), mesh.scale)?;
    check.finite(&format!("{key}.translation"), &mesh.translation)?;
    if let Some(rotation) = &mesh.rotation {
        check.direction(&format!("{key}.rotation.axis"), rotation.axis)?;
        check.finite(&format!("{key}.rotation.degrees"), &[rotation.degrees])?;
    }
    let place = || check.place(&format!("{key}.file"));
    let path = resolve(&check.origin().directory, &mesh.file, options)
        .ok_or_else(|| SceneError::MeshOutside { place: place(), file: mesh.file.clone() })?;
    let mut read =
        cloth_io::mesh_read(&path).map_err(|source| SceneError::Mesh { place: place(), source })?;
    let rotation = mesh.rotation.map(|rotation| rotation.quaternion());
    for position in &mut read.positions {
        let scaled = mesh.scale * DVec3::from(*position);
        let turned = rotation.map_or(scaled, |rotation| rotation * scaled);
        *position = (turned + DVec3::from(mesh.translation)).into();
    }
    Ok(read)
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
    let below_root =
        options.mesh_roots.iter().any(|root| path.strip_prefix(root).is_ok_and(is_below));
    (below_root || options.mesh_anywhere).then(|| directory.join(path))
}
