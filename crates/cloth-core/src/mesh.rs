//! Triangle meshes as they come from files or code, before they become cloth.

use crate::fabric::Fabric;

/// A triangle mesh with optional texture coordinates, named vertex groups and numbers of its vertices.
///
/// The mesh is plain data: nothing is checked until [`ModelBuilder`](crate::ModelBuilder) turns it
/// into cloth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Vertex indices of each triangle, zero based, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates, if the source had any.
    pub texture: Option<TextureMap>,
    /// Named sets of vertices, usable as pins.
    pub groups: Vec<VertexGroup>,
    /// Numbers of the vertices such as weights and colours, usable to choose pins.
    pub attributes: Vec<VertexAttribute>,
    /// Angle of the warp of each triangle \[rad\], counter-clockwise from the u axis of its pattern coordinates, or from the direction
    /// that a cloth without a pattern is given; empty for zero.
    pub grain: Vec<f64>,
    /// Triangles that are of another fabric than the cloth.
    pub panels: PanelFabrics,
    /// Edges at which fabric is folded at rest.
    pub folds: Vec<MeshFold>,
    /// Where the source is sewn.
    pub stitches: Vec<MeshStitch>,
    /// Whether pieces may lie face to face at an edge that they share, as they may where only a part of seams has closed. Else they are told to turn
    /// around.
    pub is_sewn_in_part: bool,
    /// Faces of the source that had more than three corners and became several triangles.
    pub polygons: usize,
}

/// Panels of a mesh that are of another fabric than its cloth, such as a collar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PanelFabrics {
    /// These fabrics.
    pub fabrics: Vec<Fabric>,
    /// For each triangle of the mesh 0 for the fabric of the cloth, or k for number k - 1 of `fabrics`; empty for zero.
    pub triangles: Vec<u32>,
}

impl PanelFabrics {
    /// The fabric of a triangle of a cloth of `base`.
    #[must_use]
    pub fn of<'a>(&'a self, base: &'a Fabric, triangle: usize) -> &'a Fabric {
        let number = self.triangles.get(triangle).copied().unwrap_or_default() as usize;
        number.checked_sub(1).and_then(|number| self.fabrics.get(number)).unwrap_or(base)
    }
}

/// Texture coordinates with indices of their own: a vertex on a seam has several coordinates, and
/// splitting the vertex instead would tear the cloth.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextureMap {
    /// Texture coordinates, dimensionless (or metres for a sewing pattern).
    pub coordinates: Vec<[f64; 2]>,
    /// For each triangle of the mesh, the index into `coordinates` of each corner.
    pub triangles: Vec<[u32; 3]>,
}

/// An edge at which fabric is folded at rest, such as a pleat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshFold {
    /// The ends of the edge, zero based. One that has not two triangles cannot be folded, and is left out.
    pub edge: [u32; 2],
    /// Angle between the normals of its two triangles \[rad\], positive where they rise on the side to which the normals point.
    pub angle: f64,
}

/// A stitch of a mesh: a vertex that is sewn to a point on an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshStitch {
    /// The vertex, zero based.
    pub vertex: u32,
    /// The ends of the edge, zero based.
    pub edge: [u32; 2],
    /// Where the point is, from 0 at the first end to 1 at the second.
    pub place: f64,
    /// The seam that it is part of, zero based.
    pub seam: u32,
}

/// A named set of vertices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VertexGroup {
    /// Name of the group, unique within its mesh.
    pub name: String,
    /// Vertex indices, zero based, ascending.
    pub vertices: Vec<u32>,
}

/// A number for each vertex of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VertexAttribute {
    /// Name of the attribute, unique within its mesh.
    pub name: String,
    /// The number of each vertex; of a colour, 0 to 1.
    pub values: Vec<f32>,
}

impl TriangleMesh {
    /// The vertices of the group called `name`.
    #[must_use]
    pub fn group(&self, name: &str) -> Option<&VertexGroup> {
        self.groups.iter().find(|group| group.name == name)
    }

    /// The attribute called `name`.
    #[must_use]
    pub fn attribute(&self, name: &str) -> Option<&VertexAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }
}
