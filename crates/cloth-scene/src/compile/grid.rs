//! Rectangular patches of a scene.

use cloth_core::{GridPatch, Meshing, Stencil, TextureMap};
use glam::DVec3;

use crate::{SceneError, SceneGrid, SceneMeshing, SceneStencil};

use super::Check;

pub(super) fn compile(
    check: &Check<'_>,
    key: &str,
    grid: &SceneGrid,
) -> Result<GridPatch, SceneError> {
    for (name, count) in [("columns", grid.columns), ("rows", grid.rows)] {
        if count < 2 {
            let problem = format!("is {count}: a patch has at least 2");
            return Err(check.error(&format!("{key}.{name}"), &problem));
        }
    }
    let spacing = match (grid.spacing, grid.size) {
        (Some(spacing), None) => [spacing; 2],
        (None, Some(size)) => {
            for side in size {
                check.positive(&format!("{key}.size"), side)?;
            }
            let cells = [grid.columns, grid.rows].map(|count| f64::from(count - 1));
            [size[0] / cells[0], size[1] / cells[1]]
        }
        (Some(_), Some(_)) => return Err(check.error(key, "has `spacing` and `size`: remove one")),
        (None, None) => return Err(check.error(key, "has no `spacing`: give it, or a `size`")),
    };
    let axis = |name: &str, direction: [f64; 3]| {
        check.direction(&format!("{key}.{name}"), direction)?;
        Ok(DVec3::from(direction).normalize_or_zero())
    };
    let column_axis = axis("column_axis", grid.column_axis)?;
    let row_axis = axis("row_axis", grid.row_axis)?;
    let origin = match (grid.origin, grid.centre) {
        (Some(_), Some(_)) => return Err(check.error(key, "has `origin` and `centre`: remove one")),
        (Some(origin), None) => origin,
        (None, centre) => {
            let centre = centre.unwrap_or_default();
            check.finite(&format!("{key}.centre"), &centre)?;
            let half = [grid.columns, grid.rows].map(|count| 0.5 * f64::from(count - 1));
            let corner = DVec3::from(centre)
                - half[0] * spacing[0] * column_axis
                - half[1] * spacing[1] * row_axis;
            corner.into()
        }
    };
    Ok(GridPatch {
        columns: grid.columns,
        rows: grid.rows,
        spacing,
        origin,
        column_axis: column_axis.into(),
        row_axis: row_axis.into(),
        stencil: match grid.stencil {
            SceneStencil::Neighbours12 => Stencil::Neighbours12,
            SceneStencil::Neighbours24 => Stencil::Neighbours24,
        },
    })
}

/// A grid of fabric in triangles.
pub(super) fn meshing(grid: &SceneGrid) -> Meshing {
    match grid.meshing {
        None | Some(SceneMeshing::Alternating) => Meshing::Alternating,
        Some(SceneMeshing::UnionJack) => Meshing::UnionJack,
        Some(SceneMeshing::OneWay) => Meshing::OneWay,
    }
}

/// Texture coordinates from (0, 0) at particle 0 to (1, 1) at the last.
pub(super) fn texture(columns: u32, rows: u32) -> TextureMap {
    let share = |index: u32, count: u32| f64::from(index) / f64::from(count.max(2) - 1);
    // The triangles of a patch depend on its counts alone.
    let patch = GridPatch { columns, rows, ..GridPatch::horizontal(2, 1.0, 0.0) };
    TextureMap {
        coordinates: (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| [share(column, columns), share(row, rows)])
            .collect(),
        triangles: patch.triangles().collect(),
    }
}

/// The pattern of a grid, from (0, 0) to (1, 1).
pub(super) fn texture_of_pattern(pattern: &TextureMap) -> TextureMap {
    let largest = |axis: usize| pattern.coordinates.iter().map(|c| c[axis]).fold(0.0, f64::max);
    let [width, height] = [largest(0), largest(1)];
    let scaled = |&[u, v]: &[f64; 2]| [u / width, v / height];
    TextureMap {
        coordinates: pattern.coordinates.iter().map(scaled).collect(),
        triangles: pattern.triangles.clone(),
    }
}
