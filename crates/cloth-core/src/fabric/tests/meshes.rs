//! Meshes of a rectangle and of a tube, regular and not.

use super::Random;
use crate::{TextureMap, TriangleMesh};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mesh {
    OneWay,
    Alternating,
    UnionJack,
    /// Vertices moved by up to a quarter of the spacing, diagonals at random.
    Irregular,
}

impl Mesh {
    pub(super) const ALL: [Self; 4] =
        [Self::OneWay, Self::Alternating, Self::UnionJack, Self::Irregular];
}

/// A rectangle of `cells` squares, or the same rolled to a tube about its second axis. Coordinates of the corners of each triangle
/// are those of the rectangle, \[m\].
pub(super) struct Sheet {
    pub(super) triangles: Vec<[u32; 3]>,
    /// For each triangle, of its corners.
    pub(super) corners: Vec<[[f64; 2]; 3]>,
    /// Of each vertex.
    pub(super) places: Vec<[f64; 2]>,
}

pub(super) fn sheet(mesh: Mesh, cells: [u32; 2], spacing: f64, is_tube: bool) -> Sheet {
    let mut random = Random(0x5eed_0123_4567_89ab);
    let columns = if is_tube { cells[0] } else { cells[0] + 1 };
    let width = f64::from(cells[0]) * spacing;
    let mut places = Vec::new();
    for row in 0..=cells[1] {
        for column in 0..columns {
            let mut place = [f64::from(column) * spacing, f64::from(row) * spacing];
            let inner_row = row > 0 && row < cells[1];
            let inner_column = is_tube || (column > 0 && column < cells[0]);
            if mesh == Mesh::Irregular {
                let moved = [random.signed(), random.signed()].map(|d| 0.25 * spacing * d);
                if inner_column {
                    place[0] += moved[0];
                }
                if inner_row {
                    place[1] += moved[1];
                }
            }
            places.push(place);
        }
    }
    let mut triangles = Vec::new();
    let mut corners = Vec::new();
    for row in 0..cells[1] {
        for column in 0..cells[0] {
            let vertex = |i: u32, j: u32| (row + j) * columns + (column + i) % columns;
            let place = |i: u32, j: u32| {
                let mut place = places[vertex(i, j) as usize];
                if column + i == columns {
                    place[0] += width;
                }
                place
            };
            let rising = match mesh {
                Mesh::OneWay => true,
                Mesh::Alternating => row % 2 == 0,
                Mesh::UnionJack => (row + column) % 2 == 0,
                Mesh::Irregular => random.signed() > 0.0,
            };
            let squares = if rising {
                [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]
            } else {
                [[[0, 0], [1, 0], [0, 1]], [[1, 0], [1, 1], [0, 1]]]
            };
            for triangle in squares {
                triangles.push(triangle.map(|[i, j]| vertex(i, j)));
                corners.push(triangle.map(|[i, j]| place(i, j)));
            }
        }
    }
    Sheet { triangles, corners, places }
}

impl Sheet {
    /// A pattern that is the rectangle turned, so that its first axis makes `angle` with the warp.
    pub(super) fn pattern(&self, angle: f64) -> TextureMap {
        let (s, c) = angle.sin_cos();
        let coordinates: Vec<[f64; 2]> =
            self.corners.iter().flatten().map(|&[x, y]| [c * x - s * y, s * x + c * y]).collect();
        let triangles = (0..self.corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        TextureMap { coordinates, triangles: triangles.collect() }
    }

    pub(super) fn mesh(&self, place: impl Fn([f64; 2]) -> [f64; 3]) -> TriangleMesh {
        TriangleMesh {
            positions: self.places.iter().map(|&at| place(at)).collect(),
            triangles: self.triangles.clone(),
            ..TriangleMesh::default()
        }
    }
}
