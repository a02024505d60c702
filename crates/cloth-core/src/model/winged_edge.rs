//! The winged-edge structure of a triangle mesh (Baumgart 1972, "Winged edge polyhedron
//! representation"), and the checks that a surface must pass to become cloth.

use crate::{ModelError, TriangleMesh};

/// Index that stands for "none".
pub const NONE: u32 = u32::MAX;

/// Edges of a triangle mesh with what lies on both sides of each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WingedEdges {
    /// The edges, sorted by their vertices.
    pub edges: Vec<WingedEdge>,
    /// For each triangle (a, b, c) the indices of its edges ab, bc and ca.
    pub triangle_edges: Vec<[u32; 3]>,
}

/// One entry for a side of a triangle: the edge, the triangle and its corner.
type Side = ([u32; 2], u32, u8);

/// One edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WingedEdge {
    /// Its vertices, the smaller index first.
    pub vertices: [u32; 2],
    /// Its triangles: first the one that runs from the smaller vertex to the larger, then the one
    /// that runs back; [`NONE`] on a border.
    pub triangles: [u32; 2],
    /// The vertex of each of these triangles that is not on the edge, or [`NONE`].
    pub opposite: [u32; 2],
}

impl WingedEdges {
    /// Builds the structure and checks the mesh: indices in range, no repeated vertex, no triangle
    /// without area, no triangle twice, at most two triangles at an edge, consistent winding, no
    /// vertex without a triangle.
    ///
    /// # Errors
    /// The [`ModelError`] of the first defect found, with its index; `cloth` is the name used in it.
    pub fn build(mesh: &TriangleMesh, cloth: &str) -> Result<Self, ModelError> {
        triangles_check(mesh.positions.len(), &mesh.triangles, cloth, |triangle| {
            is_degenerate(triangle.map(|vertex| mesh.positions[vertex as usize]))
        })?;
        Self::join(&mesh.triangles, None, cloth)
    }

    /// The same for triangles whose corners lie at these places of a pattern. How they lie in space does not matter: their area is not looked at.
    ///
    /// Where three triangles or more meet at an edge that the pattern has in different places, these are sewn together there, as in a pleat or a
    /// yoke. Such an edge stands several times: once for the triangles that are neighbours in the pattern, and as a border of each other. So does one
    /// along which two pieces are sewn face to face, if it `is_sewn_in_part`, as where parts of several seams have closed.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn of_pattern(
        vertices: usize,
        (triangles, corners): (&[[u32; 3]], &[[[f64; 2]; 3]]),
        is_sewn_in_part: bool,
        cloth: &str,
    ) -> Result<Self, ModelError> {
        triangles_check(vertices, triangles, cloth, |_| false)?;
        Self::join(triangles, Some((corners, is_sewn_in_part)), cloth)
    }

    fn join(
        triangles: &[[u32; 3]],
        pattern: Option<(&[[[f64; 2]; 3]], bool)>,
        cloth: &str,
    ) -> Result<Self, ModelError> {
        // One entry for each side of each triangle: the edge, then the triangle and its corner.
        let mut sides: Vec<Side> = Vec::with_capacity(3 * triangles.len());
        for (t, triangle) in triangles.iter().enumerate() {
            for corner in 0..3 {
                let [a, b] = [triangle[corner], triangle[(corner + 1) % 3]];
                sides.push(([a.min(b), a.max(b)], t as u32, corner as u8));
            }
        }
        sides.sort_unstable();
        let mut joined = Self {
            edges: Vec::with_capacity(sides.len() / 2),
            triangle_edges: vec![[NONE; 3]; triangles.len()],
        };
        for group in sides.chunk_by_mut(|a, b| a.0 == b.0) {
            let runs_along =
                |&(edge, t, corner): &Side| triangles[t as usize][corner as usize] == edge[0];
            let is_face_to_face =
                group.len() == 2 && runs_along(&group[0]) == runs_along(&group[1]);
            let is_split = |in_part: bool| group.len() > 2 || in_part && is_face_to_face;
            let Some((pattern, _)) = pattern.filter(|&(_, in_part)| is_split(in_part)) else {
                joined.edge(triangles, group, cloth)?;
                continue;
            };
            // Bits, as only what is the same place counts.
            let place = |&(edge, t, corner): &Side| {
                let (names, at) = (triangles[t as usize], pattern[t as usize]);
                let (from, to) = (corner as usize, (corner as usize + 1) % 3);
                let [from, to] = if names[from] == edge[0] { [from, to] } else { [to, from] };
                [at[from], at[to]].map(|at| at.map(f64::to_bits))
            };
            group.sort_by_key(|side| (place(side), side.1, side.2));
            for sewn in group.chunk_by(|a, b| place(a) == place(b)) {
                joined.edge(triangles, sewn, cloth)?;
            }
        }
        Ok(joined)
    }

    /// Adds the edge of these sides of triangles.
    fn edge(
        &mut self,
        triangles: &[[u32; 3]],
        group: &[Side],
        cloth: &str,
    ) -> Result<(), ModelError> {
        let edge_vertices = group[0].0;
        if group.len() > 2 {
            return Err(ModelError::EdgeNonManifold {
                cloth: cloth.into(),
                edge: edge_vertices,
                triangles: group.iter().map(|side| side.1).collect(),
            });
        }
        let mut edge =
            WingedEdge { vertices: edge_vertices, triangles: [NONE; 2], opposite: [NONE; 2] };
        for &(_, t, corner) in group {
            let triangle = triangles[t as usize];
            let corner = corner as usize;
            let way = usize::from(triangle[corner] != edge_vertices[0]);
            if edge.triangles[way] != NONE {
                return Err(ModelError::EdgeInconsistent {
                    cloth: cloth.into(),
                    edge: edge_vertices,
                    triangles: [edge.triangles[way], t],
                });
            }
            edge.triangles[way] = t;
            edge.opposite[way] = triangle[(corner + 2) % 3];
            self.triangle_edges[t as usize][corner] = self.edges.len() as u32;
        }
        self.edges.push(edge);
        Ok(())
    }

    /// The four wings of an edge: for each of its two triangles the other two edges, in the
    /// direction of the triangle; [`NONE`] on a border.
    #[must_use]
    pub fn wings(&self, edge: u32) -> [[u32; 2]; 2] {
        self.edges[edge as usize].triangles.map(|triangle| {
            if triangle == NONE {
                return [NONE; 2];
            }
            let sides = self.triangle_edges[triangle as usize];
            let corner = sides.iter().position(|&side| side == edge).unwrap_or(0);
            [sides[(corner + 1) % 3], sides[(corner + 2) % 3]]
        })
    }
}

fn triangles_check(
    vertices: usize,
    triangles: &[[u32; 3]],
    cloth: &str,
    is_degenerate: impl Fn([u32; 3]) -> bool,
) -> Result<(), ModelError> {
    let cloth = || cloth.to_owned();
    if vertices == 0 || triangles.is_empty() {
        return Err(ModelError::MeshEmpty { cloth: cloth(), vertices, triangles: triangles.len() });
    }
    let mut used = vec![false; vertices];
    let mut keys: Vec<([u32; 3], u32)> = Vec::with_capacity(triangles.len());
    for (t, &triangle) in triangles.iter().enumerate() {
        for vertex in triangle {
            let Some(used) = used.get_mut(vertex as usize) else {
                return Err(ModelError::TriangleOutOfRange {
                    cloth: cloth(),
                    triangle: t,
                    vertex,
                    vertices,
                });
            };
            *used = true;
        }
        let mut key = triangle;
        key.sort_unstable();
        if let Some(pair) = key.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(ModelError::TriangleRepeatsVertex {
                cloth: cloth(),
                triangle: t,
                vertex: pair[0],
            });
        }
        if is_degenerate(triangle) {
            return Err(ModelError::TriangleDegenerate { cloth: cloth(), triangle: t });
        }
        keys.push((key, t as u32));
    }
    keys.sort_unstable();
    if let Some(pair) = keys.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(ModelError::TriangleDuplicate {
            cloth: cloth(),
            first: pair[0].1 as usize,
            second: pair[1].1 as usize,
        });
    }
    match used.iter().position(|used| !used) {
        Some(vertex) => Err(ModelError::VertexIsolated { cloth: cloth(), vertex: vertex as u32 }),
        None => Ok(()),
    }
}

/// Whether twice the area is below 1e-10 of the square of the longest side: a needle so thin that
/// its normal is rounding noise.
fn is_degenerate(corners: [[f64; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(glam::DVec3::from);
    let longest =
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() <= 1e-10 * longest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> TriangleMesh {
        TriangleMesh {
            positions: positions.to_vec(),
            triangles: triangles.to_vec(),
            ..TriangleMesh::default()
        }
    }

    const SQUARE: [[f64; 3]; 4] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn a_square_has_five_edges_and_one_inner_one() {
        let mesh = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
        let edges = WingedEdges::build(&mesh, "square").unwrap();
        assert_eq!(edges.edges.len(), 5);
        let inner: Vec<_> =
            edges.edges.iter().filter(|edge| !edge.triangles.contains(&NONE)).collect();
        assert_eq!(inner.len(), 1);
        assert_eq!(inner[0].vertices, [0, 2]);
        assert_eq!(inner[0].triangles, [1, 0], "triangle 1 runs 0-2, triangle 0 runs 2-0");
        assert_eq!(inner[0].opposite, [3, 1]);
        let index = edges.edges.iter().position(|edge| edge == inner[0]).unwrap();
        let wings = edges.wings(index as u32);
        let ends = wings.map(|pair| pair.map(|edge| edges.edges[edge as usize].vertices));
        assert_eq!(ends, [[[2, 3], [0, 3]], [[0, 1], [1, 2]]]);
    }

    #[test]
    fn edges_of_a_pattern_can_be_sewn_to_more_than_one_other() {
        // Two triangles that are neighbours in the pattern, and two that are sewn to where they meet.
        let triangles = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 0, 5]];
        let pattern = [
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            [[1.0, 0.0], [0.0, 0.0], [0.0, -1.0]],
            [[5.0, 0.0], [6.0, 0.0], [5.0, 1.0]],
            [[9.0, 0.0], [8.0, 0.0], [9.0, 1.0]],
        ];
        let edges = WingedEdges::of_pattern(6, (&triangles, &pattern), false, "c").unwrap();
        let on = |k: usize| edges.edges[edges.triangle_edges[k][0] as usize].triangles;
        assert_eq!([0, 1, 2, 3].map(on), [[0, 1], [0, 1], [2, NONE], [NONE, 3]]);
        // Neighbours in the pattern are not sewn.
        let mut same = pattern;
        same[2][..2].copy_from_slice(&pattern[0][..2]);
        let error = WingedEdges::of_pattern(6, (&triangles, &same), false, "c").unwrap_err();
        assert!(
            matches!(error, ModelError::EdgeNonManifold { ref triangles, .. } if *triangles == [0, 1, 2])
        );
    }

    #[test]
    fn pieces_that_are_sewn_face_to_face_fold_on_their_own() {
        let triangles = [[0, 1, 2], [0, 1, 3]];
        let mut pattern =
            [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[5.0, 0.0], [6.0, 0.0], [5.0, 1.0]]];
        let build = |pattern: &[[[f64; 2]; 3]], in_part| {
            WingedEdges::of_pattern(4, (&triangles, pattern), in_part, "c")
        };
        let edges = build(&pattern, true).unwrap();
        let on = |k: usize| edges.edges[edges.triangle_edges[k][0] as usize].triangles;
        assert_eq!([0, 1].map(on), [[0, NONE], [1, NONE]]);
        let error = build(&pattern, false).unwrap_err();
        assert!(matches!(error, ModelError::EdgeInconsistent { edge: [0, 1], .. }));
        // Neighbours in the pattern are one piece, of which one triangle lies the wrong way around.
        pattern[1][..2].copy_from_slice(&[[0.0, 0.0], [1.0, 0.0]]);
        let error = build(&pattern, true).unwrap_err();
        assert!(matches!(error, ModelError::EdgeInconsistent { edge: [0, 1], .. }));
    }

    #[test]
    fn defects_are_named_by_index() {
        let build = |triangles: &[[u32; 3]]| {
            WingedEdges::build(&mesh(&SQUARE, triangles), "c").unwrap_err()
        };
        assert!(matches!(
            build(&[[0, 1, 2], [0, 2, 7]]),
            ModelError::TriangleOutOfRange { triangle: 1, vertex: 7, .. }
        ));
        assert!(matches!(
            build(&[[0, 1, 2], [2, 0, 2]]),
            ModelError::TriangleRepeatsVertex { triangle: 1, vertex: 2, .. }
        ));
        assert!(matches!(
            build(&[[0, 1, 2], [0, 2, 3], [2, 0, 1]]),
            ModelError::TriangleDuplicate { first: 0, second: 2, .. }
        ));
        assert!(matches!(build(&[[0, 1, 2]]), ModelError::VertexIsolated { vertex: 3, .. }));
        assert!(matches!(
            build(&[[0, 1, 2], [0, 3, 2], [0, 1, 3]]),
            ModelError::EdgeInconsistent { .. }
        ));
        assert!(matches!(build(&[]), ModelError::MeshEmpty { .. }));
        let fan = mesh(
            &[[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
            &[[0, 1, 2], [1, 0, 3], [0, 1, 4]],
        );
        let error = WingedEdges::build(&fan, "c").unwrap_err();
        assert_eq!(
            error,
            ModelError::EdgeNonManifold {
                cloth: "c".into(),
                edge: [0, 1],
                triangles: vec![0, 1, 2]
            }
        );
        let flat = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]], &[[0, 1, 2]]);
        assert!(matches!(
            WingedEdges::build(&flat, "c"),
            Err(ModelError::TriangleDegenerate { triangle: 0, .. })
        ));
    }
}
