//! How the cells of a grid are divided into triangles.

use super::GridPatch;
use crate::{TextureMap, TriangleMesh};

/// How the cells of a grid are divided into triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Meshing {
    /// Diagonals in turns, so that they meet in every other particle: no direction is preferred.
    #[default]
    Alternating,
    /// A particle more in the middle of each cell, and four triangles around it.
    UnionJack,
    /// All diagonals one way, from the first to the last corner of a cell.
    OneWay,
}

impl Meshing {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Alternating, Self::UnionJack, Self::OneWay];
}

impl GridPatch {
    /// The patch as a mesh of triangles, counter-clockwise seen against column axis x row axis. Texture coordinates are the distances
    /// from the first particle along columns and rows \[m\], the pattern of a cloth whose warp runs along the columns. The particles of the
    /// grid come first, in their order, those in the middle of cells after them, row by row.
    #[must_use]
    pub fn mesh(&self, meshing: Meshing) -> TriangleMesh {
        let [du, dv] = self.spacing;
        let cells = [self.columns.saturating_sub(1), self.rows.saturating_sub(1)];
        let corners = (0..self.rows).flat_map(|row| {
            (0..self.columns).map(move |column| [f64::from(column) * du, f64::from(row) * dv])
        });
        let mut coordinates: Vec<[f64; 2]> = corners.collect();
        if meshing == Meshing::UnionJack {
            coordinates.extend((0..cells[1]).flat_map(|row| {
                (0..cells[0]).map(move |column| {
                    [(f64::from(column) + 0.5) * du, (f64::from(row) + 0.5) * dv]
                })
            }));
        }
        let count = self.columns * self.rows;
        let mut triangles = Vec::new();
        for row in 0..cells[1] {
            for column in 0..cells[0] {
                let [a, b] = [self.particle(column, row), self.particle(column + 1, row)];
                let [c, d] = [a + self.columns, b + self.columns];
                match meshing {
                    Meshing::UnionJack => {
                        let middle = count + row * cells[0] + column;
                        triangles.extend(
                            [[a, b], [b, d], [d, c], [c, a]].map(|[from, to]| [from, to, middle]),
                        );
                    }
                    Meshing::Alternating if (row + column) % 2 == 1 => {
                        triangles.extend([[a, b, c], [b, d, c]]);
                    }
                    Meshing::Alternating | Meshing::OneWay => {
                        triangles.extend([[a, b, d], [a, d, c]]);
                    }
                }
            }
        }
        let position = |&[u, v]: &[f64; 2]| {
            std::array::from_fn(|k| self.origin[k] + u * self.column_axis[k] + v * self.row_axis[k])
        };
        TriangleMesh {
            positions: coordinates.iter().map(position).collect(),
            texture: Some(TextureMap { coordinates, triangles: triangles.clone() }),
            triangles,
            ..TriangleMesh::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WingedEdges;

    #[test]
    fn every_meshing_covers_the_patch_with_a_surface() {
        let patch = GridPatch { rows: 4, ..GridPatch::horizontal(5, 0.1, 0.0) };
        for meshing in Meshing::ALL {
            let mesh = patch.mesh(meshing);
            WingedEdges::build(&mesh, "patch").unwrap();
            let area: f64 = mesh
                .triangles
                .iter()
                .map(|triangle| {
                    let [a, b, c] = triangle.map(|v| glam::DVec3::from(mesh.positions[v as usize]));
                    let normal = (b - a).cross(c - a);
                    assert!(normal.z > 0.0);
                    0.5 * normal.length()
                })
                .sum();
            assert!((area - 12.0 * 0.01).abs() < 1e-12, "{meshing:?}");
            assert_eq!(mesh.positions[..20].len(), 20);
        }
        let one_way = patch.mesh(Meshing::OneWay);
        assert!(one_way.triangles.iter().copied().eq(patch.triangles()));
    }
}
