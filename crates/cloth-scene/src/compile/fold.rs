//! Where fabric is folded at rest.

use std::collections::HashSet;

use cloth_core::{MeshFold, TriangleMesh};

use crate::{SceneCloth, SceneError, SceneFold};

use super::{Check, pins::PinSets};

/// The folded edges of the cloth at `key`, whose mesh still has its groups unless `sets` is of a grid.
pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    cloth: &SceneCloth,
    (mesh, sets): (&TriangleMesh, &PinSets),
) -> Result<Vec<MeshFold>, SceneError> {
    let mut folds = Vec::new();
    for (index, fold) in cloth.folds.iter().enumerate() {
        let key = format!("{key}.folds[{index}]");
        let angle = format!("{key}.angle");
        check.finite(&angle, &[fold.angle])?;
        if fold.angle.abs() > 180.0 {
            let problem = format!("is {}: give -180 to 180 degrees", fold.angle);
            return Err(check.error(&angle, &problem));
        }
        for line in &fold.lines {
            let key = format!("{key}.lines");
            let set = sets.of_mesh((check, &key), mesh, line, std::iter::empty())?;
            let before = folds.len();
            folds.extend(within(mesh, &set, fold.angle.to_radians()));
            if folds.len() == before {
                let problem = format!(
                    "{line:?} has no edge between two triangles: name a line within the cloth"
                );
                return Err(check.error(&key, &problem));
            }
        }
    }
    Ok(folds)
}

/// The folds of a piece on its own, along those lines that it has.
pub(super) fn of_mesh(folds: &[SceneFold], mesh: &TriangleMesh) -> Vec<MeshFold> {
    let groups = folds.iter().flat_map(|fold| {
        let own = fold.lines.iter().filter_map(|line| mesh.group(line));
        own.map(|group| (group, fold.angle.to_radians()))
    });
    groups.flat_map(|(group, angle)| within(mesh, &group.vertices, angle)).collect()
}

/// The edges between two triangles that have both ends in `set`, ascending.
fn within(mesh: &TriangleMesh, set: &[u32], angle: f64) -> Vec<MeshFold> {
    let set: HashSet<u32> = set.iter().copied().collect();
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let is_own = |edge: &[u32; 2]| edge.iter().all(|vertex| set.contains(vertex));
    let edges = mesh.triangles.iter().flat_map(sides).filter(is_own);
    let mut edges: Vec<_> = edges.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    // An edge of one triangle is a border.
    let inner = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 2);
    inner.map(|same| MeshFold { edge: same[0], angle }).collect()
}
