//! Pieces of cloth cut to size, meshed in three ways.

use cloth_core::{GridPatch, Meshing, TextureMap, TriangleMesh};

/// How a piece is meshed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshKind {
    /// Diagonals all one way.
    Regular,
    /// Diagonals in turns.
    Alternating,
    /// Inner vertices moved and diagonals chosen at random.
    Irregular,
}

/// A rectangular piece of cloth: its length along x, its width along y, in the plane z = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strip {
    /// Length \[m\].
    pub(crate) length: f64,
    /// Width \[m\].
    pub(crate) width: f64,
    /// Cells along its length and width.
    pub(crate) cells: [u32; 2],
    /// How it is meshed.
    pub(crate) kind: MeshKind,
    /// Angle from the warp to its length \[rad\].
    pub(crate) angle: f64,
}

/// Share of a cell by which inner vertices of irregular meshes are moved at most.
const JITTER: f64 = 0.25;

impl MeshKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Regular, Self::Alternating, Self::Irregular];

    /// It in a word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Regular => "regular",
            Self::Alternating => "alternating",
            Self::Irregular => "irregular",
        }
    }
}

impl Strip {
    /// A strip whose first cells are held, with this length and width beyond the clamp \[m\]. A cell that is held fixes the slope in its
    /// middle: there the clamp is.
    pub(crate) fn clamped(
        [length, width]: [f64; 2],
        cells: [u32; 2],
        (kind, angle): (MeshKind, f64),
    ) -> Self {
        let cell = length / (f64::from(cells[0]) - 0.5);
        Self { length: length + 0.5 * cell, width, cells, kind, angle }
    }

    /// Length of its cells \[m\].
    pub(crate) fn cell(&self) -> f64 {
        self.length / f64::from(self.cells[0])
    }

    /// Its mesh, with the pattern as texture coordinates \[m\]. The first cell's corner is at the origin.
    pub(crate) fn mesh(&self) -> TriangleMesh {
        let [columns, rows] = self.cells.map(|cells| cells + 1);
        let patch = GridPatch {
            columns,
            rows,
            spacing: [
                self.length / f64::from(self.cells[0]),
                self.width / f64::from(self.cells[1]),
            ],
            origin: [0.0; 3],
            ..GridPatch::horizontal(2, 1.0, 0.0)
        };
        let meshing = match self.kind {
            MeshKind::Regular => Meshing::OneWay,
            MeshKind::Alternating | MeshKind::Irregular => Meshing::Alternating,
        };
        let mut mesh = patch.mesh(meshing);
        if self.kind == MeshKind::Irregular {
            self.shuffle(&patch, &mut mesh);
        }
        let (sine, cosine) = self.angle.sin_cos();
        let pattern = |&[x, y, _]: &[f64; 3]| [cosine * x - sine * y, sine * x + cosine * y];
        mesh.texture = Some(TextureMap {
            coordinates: mesh.positions.iter().map(pattern).collect(),
            triangles: mesh.triangles.clone(),
        });
        mesh
    }

    /// Moves vertices within, and turns diagonals.
    fn shuffle(&self, patch: &GridPatch, mesh: &mut TriangleMesh) {
        let mut random = fastrand::Rng::with_seed(5);
        for row in 0..patch.rows {
            for column in 0..patch.columns {
                let is_inside =
                    [column > 0 && column + 1 < patch.columns, row > 0 && row + 1 < patch.rows];
                let position = &mut mesh.positions[patch.particle(column, row) as usize];
                for axis in 0..2 {
                    let shift = JITTER * patch.spacing[axis] * (2.0 * random.f64() - 1.0);
                    // The second column stays where it is: cloth is clamped between it and the first one.
                    if is_inside[axis] && !(axis == 0 && column == 1) {
                        position[axis] += shift;
                    }
                }
            }
        }
        mesh.triangles = random_triangles(patch, &mut random);
    }
}

/// The cells of a grid, each with a diagonal at random.
fn random_triangles(patch: &GridPatch, random: &mut fastrand::Rng) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    for row in 0..patch.rows - 1 {
        for column in 0..patch.columns - 1 {
            let [a, b] = [patch.particle(column, row), patch.particle(column + 1, row)];
            let [c, d] = [a + patch.columns, b + patch.columns];
            triangles.extend(if random.bool() {
                [[a, b, d], [a, d, c]]
            } else {
                [[a, b, c], [b, d, c]]
            });
        }
    }
    triangles
}

/// The ring of a round specimen that hangs over a support: around the origin in the plane z = 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    /// Inner and outer radius \[m\].
    pub(crate) radii: [f64; 2],
    /// Cells around, and from the inner to the outer radius.
    pub(crate) cells: [u32; 2],
    /// How it is meshed.
    pub(crate) kind: MeshKind,
}

impl Ring {
    /// Its mesh, with the pattern as texture coordinates \[m\].
    pub(crate) fn mesh(&self) -> TriangleMesh {
        let [around, out] = self.cells;
        // A grid that is one cell short of closing, with a seam of cells between its last and its first column.
        let patch = GridPatch {
            columns: around + 1,
            rows: out + 1,
            spacing: [1.0; 2],
            origin: [0.0; 3],
            ..GridPatch::horizontal(2, 1.0, 0.0)
        };
        let mut random = fastrand::Rng::with_seed(9);
        let triangles = match self.kind {
            MeshKind::Regular => patch.mesh(Meshing::OneWay).triangles,
            MeshKind::Alternating => patch.mesh(Meshing::Alternating).triangles,
            MeshKind::Irregular => random_triangles(&patch, &mut random),
        };
        let closed = |vertex: u32| {
            let [row, column] = [vertex / patch.columns, vertex % patch.columns];
            row * around + column % around
        };
        let mut positions = Vec::new();
        for row in 0..=out {
            for column in 0..around {
                let mut shift = || match self.kind {
                    MeshKind::Irregular => JITTER * (2.0 * random.f64() - 1.0),
                    _ => 0.0,
                };
                let turn = f64::from(column) + shift();
                let place = f64::from(row) + if row > 1 && row < out { shift() } else { 0.0 };
                let radius =
                    self.radii[0] + (self.radii[1] - self.radii[0]) * place / f64::from(out);
                let (s, c) = (std::f64::consts::TAU * turn / f64::from(around)).sin_cos();
                positions.push([radius * c, radius * s, 0.0]);
            }
        }
        let triangles: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(closed)).collect();
        let coordinates = positions.iter().map(|&[x, y, _]| [x, y]).collect();
        TriangleMesh {
            positions,
            texture: Some(TextureMap { coordinates, triangles: triangles.clone() }),
            triangles,
            ..TriangleMesh::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mesh_covers_the_strip() {
        for kind in MeshKind::ALL {
            let strip = Strip { length: 0.3, width: 0.1, cells: [9, 4], kind, angle: 0.7 };
            let mesh = strip.mesh();
            let pattern = mesh.texture.as_ref().unwrap();
            let area: f64 = pattern
                .triangles
                .iter()
                .map(|triangle| {
                    let [a, b, c] = triangle.map(|corner| pattern.coordinates[corner as usize]);
                    let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                    assert!(twice > 0.0, "{kind:?}");
                    0.5 * twice
                })
                .sum();
            assert!((area - 0.03).abs() < 1e-12, "{kind:?}");
        }
    }
}
