//! Pieces of a flat pattern: where they are, and what they are called.

use std::path::Path;

use cloth_core::{MeshFold, TextureMap, TriangleMesh};
use glam::DVec3;

use crate::{
    SceneError, SceneFold, ScenePanels, ScenePiece,
    error::SceneUnknown,
    panels::{Outline, folded, outlines_read, piece_mesh},
};

use super::{Check, CompileOptions, collider::rotation_check, fold, mesh::resolve};

/// The mesh of all pieces at `key`; its pattern is in metres, and its warp has the angles that the pieces say.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    (panels, folds): (&ScenePanels, &[SceneFold]),
    options: &CompileOptions,
) -> Result<TriangleMesh, SceneError> {
    check.positive(&format!("{key}.edge"), panels.edge)?;
    if let Some(unit) = panels.unit {
        check.positive(&format!("{key}.unit"), unit)?;
    }
    if panels.pieces.is_empty() {
        return Err(check.error(&format!("{key}.pieces"), "is empty: give at least one piece"));
    }
    let file = format!("{key}.file");
    let path = resolve(&check.origin().directory, &panels.file, options).ok_or_else(|| {
        let problem = "is not a plain path below the folder of the scene: keep it there, or allow its folder as a mesh root";
        check.error(&file, problem)
    })?;
    let outlines = outlines_read(&path, panels.unit)
        .map_err(|problem| check.error(&file, &format!("cannot be used: {problem}")))?;
    let mut whole =
        TriangleMesh { texture: Some(TextureMap::default()), ..TriangleMesh::default() };
    // Pieces lie side by side in the pattern.
    let mut right = 0.0;
    for (index, piece) in panels.pieces.iter().enumerate() {
        let key = format!("{key}.pieces[{index}]");
        let Some(outline) = outlines.iter().find(|outline| outline.name == piece.outline) else {
            let known = outlines.iter().map(|outline| outline.name.clone()).collect();
            let place = check.place(&format!("{key}.outline"));
            return Err(SceneUnknown::error(place, "outline", &piece.outline, known));
        };
        let name = piece.name.clone().unwrap_or_else(|| outline.name.clone());
        if whole.group(&name).is_some() {
            let problem = format!("{name:?} is the name of two pieces: give `name` to one");
            return Err(check.error(&key, &problem));
        }
        let outline = Outline { name, ..outline.clone() };
        let mesh = piece_mesh(outline, panels.edge)
            .map_err(|problem| check.error(&format!("{key}.outline"), &problem))?;
        let folds = if piece.folded { fold::of_mesh(folds, &mesh) } else { vec![] };
        let placed = place(check, &key, piece, (mesh, &folds), &mut right)?;
        append(&mut whole, placed);
    }
    Ok(whole)
}

/// About how many vertices panels have; 0 if their file cannot be read.
pub(super) fn particles(directory: &Path, panels: &ScenePanels, options: &CompileOptions) -> u64 {
    let outlines = resolve(directory, &panels.file, options)
        .and_then(|path| outlines_read(&path, panels.unit).ok())
        .unwrap_or_default();
    let of = |piece: &ScenePiece| {
        let outline = outlines.iter().find(|outline| outline.name == piece.outline)?;
        let [low, high] = outline.bounds();
        Some((high.x - low.x) * (high.y - low.y) / (0.866 * panels.edge * panels.edge))
    };
    panels.pieces.iter().filter_map(of).sum::<f64>() as u64
}

/// Puts a piece where it is at the start, and its pattern to the right of those before.
fn place(
    check: &Check<'_>,
    key: &str,
    piece: &ScenePiece,
    (mut mesh, folds): (TriangleMesh, &[MeshFold]),
    right: &mut f64,
) -> Result<TriangleMesh, SceneError> {
    check.finite(&format!("{key}.warp"), &[piece.warp])?;
    check.finite(&format!("{key}.translation"), &piece.translation)?;
    if let Some(radius) = piece.radius {
        check.positive(&format!("{key}.radius"), radius)?;
    }
    if let Some(rotation) = &piece.rotation {
        rotation_check(check, &format!("{key}.rotation"), rotation)?;
    }
    let rotation = piece.rotation.map(|rotation| rotation.quaternion());
    let side = if piece.mirror { -1.0 } else { 1.0 };
    let width = centred(&mut mesh.positions, side);
    let texture = mesh.texture.get_or_insert_default();
    for (position, uv) in mesh.positions.iter().zip(&mut texture.coordinates) {
        *uv = [*right + 0.5 * width + position[0], position[1]];
    }
    if piece.mirror {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        texture.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }
    if !folds.is_empty() {
        mesh.positions = folded(&mesh, folds);
        centred(&mut mesh.positions, 1.0);
    }
    for position in &mut mesh.positions {
        let [x, y, front] = *position;
        let upright = match piece.radius {
            Some(radius) => {
                let (sine, cosine) = (x / radius).sin_cos();
                let outer = radius + front;
                DVec3::new(outer * sine, radius - outer * cosine, y)
            }
            None => DVec3::new(x, -front, y),
        };
        let turned = rotation.map_or(upright, |rotation| rotation * upright);
        *position = (turned + DVec3::from(piece.translation)).into();
    }
    *right += 1.05 * width;
    let warp = if piece.mirror { 180.0 - piece.warp } else { piece.warp };
    mesh.grain = vec![warp.to_radians(); mesh.triangles.len()];
    Ok(mesh)
}

/// Puts the middle of the box around `positions` in x and y, and that of their depth, at the origin, and mirrors them for -1. Returns the width.
fn centred(positions: &mut [[f64; 3]], side: f64) -> f64 {
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    for position in &*positions {
        for axis in 0..3 {
            low[axis] = low[axis].min(position[axis]);
            high[axis] = high[axis].max(position[axis]);
        }
    }
    let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    for position in positions {
        *position = std::array::from_fn(|axis| position[axis] - middle[axis]);
        position[0] *= side;
    }
    high[0] - low[0]
}

fn append(whole: &mut TriangleMesh, piece: TriangleMesh) {
    let first = whole.positions.len() as u32;
    let moved = |triangle: &[u32; 3]| triangle.map(|vertex| vertex + first);
    whole.positions.extend(piece.positions);
    whole.triangles.extend(piece.triangles.iter().map(moved));
    whole.grain.extend(piece.grain);
    // A piece has as many coordinates as vertices.
    if let (Some(all), Some(own)) = (&mut whole.texture, piece.texture) {
        all.coordinates.extend(own.coordinates);
        all.triangles.extend(own.triangles.iter().map(moved));
    }
    whole.groups.extend(piece.groups.into_iter().map(|mut group| {
        group.vertices.iter_mut().for_each(|vertex| *vertex += first);
        group
    }));
}
