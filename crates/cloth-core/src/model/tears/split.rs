//! A mesh becomes one whose triangles share no vertices.

use super::{Tear, TearEdge};
use crate::{MeshFold, TriangleMesh, VertexAttribute, VertexGroup, model::VertexClasses};

/// A mesh whose triangles share no vertices, and what joins them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SplitMesh {
    /// The mesh. The first corner at each vertex of the mesh before has the number of that vertex, the others come behind all of them.
    pub mesh: TriangleMesh,
    /// Edges and bonds, for a cloth of no name yet that tears at no strain.
    pub tear: Tear,
    /// For each corner the vertex of the mesh before.
    pub origins: Vec<u32>,
}

/// A side of a triangle: the vertices of its ends, the smaller first, the triangle and the number of the side.
type Side = ([u32; 2], u32, u8);

impl TriangleMesh {
    /// The mesh with vertices of its own for each triangle, so that it can tear at each edge. Vertices without triangles stay. Groups and
    /// attributes are those of the vertices before; stitches stay at the first corners.
    ///
    /// ```
    /// use cloth_core::TriangleMesh;
    ///
    /// let mesh = TriangleMesh {
    ///     positions: vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]],
    ///     triangles: vec![[0, 1, 2], [0, 2, 3]],
    ///     ..TriangleMesh::default()
    /// };
    /// let split = mesh.split();
    /// assert_eq!(split.mesh.triangles, [[0, 1, 2], [4, 5, 3]]);
    /// assert_eq!(split.origins, [0, 1, 2, 3, 0, 2]);
    /// assert_eq!(split.tear.edges[0].joints, [[0, 4], [2, 5]]);
    /// ```
    #[must_use]
    pub fn split(self) -> SplitMesh {
        let before = self.triangles.clone();
        let count = self.positions.len();
        let mut origins: Vec<u32> = (0..count as u32).collect();
        let mut is_taken = vec![false; count];
        let mut triangles = before.clone();
        for corner in triangles.iter_mut().flatten() {
            let vertex = *corner;
            // What is out of range is left to whoever makes cloth of the mesh.
            let Some(taken) = is_taken.get_mut(vertex as usize) else { continue };
            if std::mem::replace(taken, true) {
                *corner = origins.len() as u32;
                origins.push(vertex);
            }
        }
        let edges = joined_edges(&before, &triangles);
        let bonds = bonds(&edges, &origins);
        // A fold is at a side of one of its triangles.
        let folds = self.folds.iter().map(|fold| {
            let is_at = |edge: &&TearEdge| {
                let ends = ends(&before, edge.triangles[0], edge.sides[0]);
                ends == fold.edge || ends == [fold.edge[1], fold.edge[0]]
            };
            let edge = match edges.iter().find(is_at) {
                Some(edge) => ends(&triangles, edge.triangles[0], edge.sides[0]),
                None => fold.edge,
            };
            MeshFold { edge, ..*fold }
        });
        let folds = folds.collect();
        let group = |group: VertexGroup| {
            let has = |(_, origin): &(u32, &u32)| group.vertices.binary_search(origin).is_ok();
            let vertices = (0..).zip(&origins).filter(has).map(|(corner, _)| corner).collect();
            VertexGroup { vertices, ..group }
        };
        let attribute = |attribute: VertexAttribute| {
            let of = |origin: &u32| attribute.values.get(*origin as usize).copied();
            let values = origins.iter().map(|origin| of(origin).unwrap_or_default()).collect();
            VertexAttribute { values, ..attribute }
        };
        let of = |origin: &u32| self.positions[*origin as usize];
        let mesh = Self {
            positions: origins.iter().map(of).collect(),
            triangles,
            folds,
            groups: self.groups.into_iter().map(group).collect(),
            attributes: self.attributes.into_iter().map(attribute).collect(),
            ..self
        };
        SplitMesh { mesh, tear: Tear { edges, bonds, ..Tear::default() }, origins }
    }
}

/// The ends of a side.
fn ends(triangles: &[[u32; 3]], triangle: u32, side: u8) -> [u32; 2] {
    let (corners, side) = (triangles[triangle as usize], usize::from(side));
    [corners[side], corners[(side + 1) % 3]]
}

/// The edges that triangles `before` share, with the corners that they have now.
fn joined_edges(before: &[[u32; 3]], now: &[[u32; 3]]) -> Vec<TearEdge> {
    let mut sides: Vec<Side> = Vec::with_capacity(3 * before.len());
    for triangle in 0..before.len() as u32 {
        for side in 0..3 {
            let [a, b] = ends(before, triangle, side);
            sides.push(([a.min(b), a.max(b)], triangle, side));
        }
    }
    sides.sort_unstable();
    // Where three triangles meet, each is joined to the next.
    let pairs = sides.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let edge = |pair: &[Side]| {
        let both = [pair[0], pair[1]];
        let corners = both.map(|(edge, triangle, side)| {
            let [a, b] = ends(now, triangle, side);
            if ends(before, triangle, side) == edge { [a, b] } else { [b, a] }
        });
        let [[a, b], [c, d]] = corners;
        let triangles = both.map(|(_, triangle, _)| triangle);
        TearEdge { triangles, sides: both.map(|(_, _, side)| side), joints: [[a, c], [b, d]] }
    };
    pairs.map(edge).collect()
}

/// Joins the corners of each vertex that no edges join.
fn bonds(edges: &[TearEdge], origins: &[u32]) -> Vec<[u32; 2]> {
    let mut classes = VertexClasses::new(origins.len());
    edges.iter().flat_map(|edge| edge.joints).for_each(|[a, b]| classes.join(a, b));
    let mut bonds = Vec::new();
    for (corner, &origin) in (0..).zip(origins) {
        if classes.of(corner) != classes.of(origin) {
            classes.join(corner, origin);
            bonds.push([origin, corner]);
        }
    }
    bonds
}
