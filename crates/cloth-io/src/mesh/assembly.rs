//! Puts the parts that a reader found together into a checked mesh.

use std::collections::{BTreeMap, BTreeSet};

use cloth_core::{TextureMap, TriangleMesh, VertexAttribute, VertexGroup};

use super::{MeshError, MeshPlace};

/// One corner of a polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Vertex index, zero based; it may be out of range until [`MeshAssembly::finish`].
    pub(super) vertex: i64,
    /// Texture coordinate index, zero based.
    pub(super) texture: Option<i64>,
}

/// A mesh while its file is being read.
#[derive(Default)]
pub(super) struct MeshAssembly {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) coordinates: Vec<[f64; 2]>,
    /// Numbers of the vertices, all of the length of `positions`.
    pub(super) attributes: Vec<VertexAttribute>,
    triangles: Vec<[Corner; 3]>,
    /// Place in the file of each triangle.
    places: Vec<MeshPlace>,
    /// For each triangle, the index into `group_sets`.
    group_of_triangle: Vec<usize>,
    /// Sets of group names that were in force together.
    group_sets: Vec<Vec<String>>,
    /// Vertices that belong to groups by themselves.
    members: Vec<Member>,
}

/// A vertex that belongs to groups without any face.
struct Member {
    /// Zero based; it may be out of range until [`MeshAssembly::finish`].
    vertex: i64,
    place: MeshPlace,
    /// Index into `group_sets`.
    groups: usize,
}

impl MeshAssembly {
    /// Declares the group names that the faces after this call belong to.
    pub(super) fn group_names(&mut self, names: Vec<String>) {
        self.group_sets.push(names);
    }

    /// Adds a polygon as a fan of triangles around its first corner.
    pub(super) fn polygon(
        &mut self,
        file: &str,
        place: MeshPlace,
        corners: &[Corner],
    ) -> Result<(), MeshError> {
        let [first, rest @ ..] = corners else {
            return Err(face_too_small(file, place, 0));
        };
        if rest.len() < 2 {
            return Err(face_too_small(file, place, corners.len()));
        }
        if let Some(vertex) = repeated_vertex(corners) {
            let vertex = u32::try_from(vertex).unwrap_or(u32::MAX);
            let file = file.to_owned();
            return Err(MeshError::Repeated { file, place, vertex });
        }
        let groups = self.groups_in_force();
        for pair in rest.windows(2) {
            self.triangles.push([*first, pair[0], pair[1]]);
            self.places.push(place);
            self.group_of_triangle.push(groups);
        }
        Ok(())
    }

    /// Puts a vertex into the groups in force, which faces around it do not change.
    pub(super) fn member(&mut self, place: MeshPlace, vertex: i64) {
        let groups = self.groups_in_force();
        self.members.push(Member { vertex, place, groups });
    }

    /// The index of the group names in force; there are none before the file names any.
    fn groups_in_force(&mut self) -> usize {
        if self.group_sets.is_empty() {
            self.group_sets.push(Vec::new());
        }
        self.group_sets.len() - 1
    }

    /// Checks everything and makes the mesh. `index_base` is the number by which the file counts
    /// its first vertex, so that errors name indices as the file does.
    pub(super) fn finish(self, file: &str, index_base: i64) -> Result<TriangleMesh, MeshError> {
        self.check_sizes(file)?;
        let vertex_count = self.positions.len();
        let coordinate_count = self.coordinates.len();
        let checked = |index: i64, count: usize, what: &'static str, place: MeshPlace| {
            u32::try_from(index).ok().filter(|&index| (index as usize) < count).ok_or_else(|| {
                MeshError::Index {
                    file: file.to_owned(),
                    place,
                    what,
                    index: index.saturating_add(index_base),
                    count,
                }
            })
        };
        let mut triangles = Vec::with_capacity(self.triangles.len());
        let mut texture_triangles = Vec::with_capacity(self.triangles.len());
        for (number, corners) in self.triangles.iter().enumerate() {
            let mut triangle = [0; 3];
            let mut texture_triangle = [0; 3];
            let mut textured = true;
            let place = self.places[number];
            for (slot, corner) in corners.iter().enumerate() {
                triangle[slot] = checked(corner.vertex, vertex_count, "vertex", place)?;
                match corner.texture {
                    Some(index) => {
                        texture_triangle[slot] =
                            checked(index, coordinate_count, "texture coordinate", place)?;
                    }
                    None => textured = false,
                }
            }
            triangles.push(triangle);
            if textured {
                texture_triangles.push(texture_triangle);
            }
        }
        let members = self.members.iter().map(|member| {
            let vertex = checked(member.vertex, vertex_count, "vertex", member.place)?;
            Ok((member.groups, vertex))
        });
        let members = members.collect::<Result<Vec<_>, MeshError>>()?;
        let groups = self.groups(&triangles, &members);
        // A map that lacks some corners could not be indexed by triangle, so it is all or nothing.
        let texture = (texture_triangles.len() == triangles.len())
            .then_some(TextureMap { coordinates: self.coordinates, triangles: texture_triangles });
        let Self { positions, attributes, .. } = self;
        Ok(TriangleMesh { positions, triangles, texture, groups, attributes })
    }

    fn check_sizes(&self, file: &str) -> Result<(), MeshError> {
        let file = || file.to_owned();
        if self.positions.is_empty() {
            let what = "vertices";
            return Err(MeshError::Empty { file: file(), what });
        }
        if self.triangles.is_empty() {
            let what = "triangles";
            return Err(MeshError::Empty { file: file(), what });
        }
        let not_finite = |values: &[f64]| values.iter().any(|value| !value.is_finite());
        if let Some(vertex) = self.positions.iter().position(|p| not_finite(p)) {
            return Err(MeshError::Position { file: file(), vertex });
        }
        if let Some(coordinate) = self.coordinates.iter().position(|c| not_finite(c)) {
            let file = file();
            return Err(MeshError::TextureCoordinate { file, coordinate });
        }
        Ok(())
    }

    /// The groups of all `triangles` and of `members`, each the index of a set of names and a vertex.
    fn groups(&self, triangles: &[[u32; 3]], members: &[(usize, u32)]) -> Vec<VertexGroup> {
        let mut vertices: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
        for (triangle, &set) in triangles.iter().zip(&self.group_of_triangle) {
            for name in &self.group_sets[set] {
                vertices.entry(name).or_default().extend(triangle);
            }
        }
        for &(set, vertex) in members {
            for name in &self.group_sets[set] {
                vertices.entry(name).or_default().insert(vertex);
            }
        }
        // Groups come in the order in which the file names them.
        let mut groups = Vec::with_capacity(vertices.len());
        for name in self.group_sets.iter().flatten() {
            if let Some(vertices) = vertices.remove(name.as_str()) {
                groups.push(VertexGroup {
                    name: name.clone(),
                    vertices: vertices.into_iter().collect(),
                });
            }
        }
        groups
    }
}

fn face_too_small(file: &str, place: MeshPlace, corners: usize) -> MeshError {
    MeshError::Syntax {
        file: file.to_owned(),
        place,
        problem: format!("a face needs at least 3 corners but has {corners}"),
    }
}

/// The vertex that two of `corners` share, if any.
fn repeated_vertex(corners: &[Corner]) -> Option<i64> {
    if let [a, b, c] = corners {
        let repeated = a.vertex == b.vertex || a.vertex == c.vertex;
        return (repeated.then_some(a.vertex)).or((b.vertex == c.vertex).then_some(b.vertex));
    }
    let mut vertices: Vec<i64> = corners.iter().map(|corner| corner.vertex).collect();
    vertices.sort_unstable();
    vertices.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0])
}
