//! Puts the parts that a reader found together into a checked mesh.

use std::collections::{BTreeSet, HashMap};

use cloth_core::{MeshStitch, TextureMap, TriangleMesh, VertexAttribute, VertexGroup};

use super::{MESH_COUNT_MAX, MeshError, MeshPlace};

/// Longest name of a group \[byte\]. Many groups can share a name, so a long one could fill the memory.
const NAME_MAX: usize = 1024;

/// A corner without texture coordinates.
const UNTEXTURED: u32 = u32::MAX;

/// One corner of a polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Vertex index, zero based; it may be out of range until [`MeshAssembly::finish`].
    pub(super) vertex: i64,
    /// Texture coordinate index, zero based.
    pub(super) texture: Option<i64>,
}

/// A mesh while its file is being read.
pub(super) struct MeshAssembly {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) coordinates: Vec<[f64; 2]>,
    /// Numbers of the vertices, all of the length of `positions`.
    pub(super) attributes: Vec<VertexAttribute>,
    triangles: Vec<[u32; 3]>,
    texture_triangles: Vec<[u32; 3]>,
    /// Line or face of each triangle, as `place` wants it.
    numbers: Vec<u32>,
    /// What these numbers count.
    place: fn(usize) -> MeshPlace,
    /// The number by which the file counts its first vertex, so that errors name indices as the file does.
    index_base: i64,
    names: Names,
    /// The first triangle of each run of triangles of the same groups, with the number of its set.
    runs: Vec<(usize, usize)>,
    /// Vertices that belong to groups by themselves.
    members: Vec<Member>,
    /// Faces with more than three corners.
    polygons: usize,
    /// Where it is sewn.
    pub(super) stitches: Vec<MeshStitch>,
}

/// A vertex that belongs to groups without any face.
struct Member {
    /// It may be out of range until [`MeshAssembly::finish`].
    vertex: u32,
    /// Line or face.
    number: u32,
    /// Number of the set of names.
    set: u32,
}

/// Names of groups, each kept once.
#[derive(Default)]
struct Names {
    /// In the order in which the file names them first.
    list: Vec<String>,
    numbers: HashMap<String, u32>,
    /// Sets of names that are in force together, each once.
    sets: Vec<Vec<u32>>,
    set_numbers: HashMap<Vec<u32>, usize>,
}

impl MeshAssembly {
    /// An empty mesh; `place` is what the numbers of its faces count, `index_base` the number of the first vertex.
    pub(super) fn new(place: fn(usize) -> MeshPlace, index_base: i64) -> Self {
        Self {
            positions: Vec::new(),
            coordinates: Vec::new(),
            attributes: Vec::new(),
            triangles: Vec::new(),
            texture_triangles: Vec::new(),
            numbers: Vec::new(),
            place,
            index_base,
            names: Names::default(),
            runs: Vec::new(),
            members: Vec::new(),
            polygons: 0,
            stitches: Vec::new(),
        }
    }

    /// The number of a name.
    pub(super) fn name(&mut self, file: &str, name: &str) -> Result<u32, MeshError> {
        if let Some(&number) = self.names.numbers.get(name) {
            return Ok(number);
        }
        if name.len() > NAME_MAX {
            return Err(too_large(file, "bytes in the name of a group", name.len(), NAME_MAX));
        }
        let number = self.names.list.len() as u32;
        self.names.list.push(name.to_owned());
        self.names.numbers.insert(name.to_owned(), number);
        Ok(number)
    }

    /// Declares the groups, by the numbers of their names, that the faces after this call belong to.
    pub(super) fn groups_begin(&mut self, names: Vec<u32>) {
        let Names { sets, set_numbers, .. } = &mut self.names;
        let set = *set_numbers.entry(names).or_insert_with_key(|names| {
            sets.push(names.clone());
            sets.len() - 1
        });
        let start = self.triangles.len();
        // Groups that got no faces leave nothing behind.
        match self.runs.last_mut() {
            Some(last) if last.0 == start => last.1 = set,
            _ => self.runs.push((start, set)),
        }
    }

    /// Adds the polygon of line or face `number` as a fan of triangles around its first corner.
    pub(super) fn polygon(
        &mut self,
        file: &str,
        number: usize,
        corners: &[Corner],
    ) -> Result<(), MeshError> {
        let place = (self.place)(number);
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
        let count = self.triangles.len() + rest.len() - 1;
        if count as u64 > MESH_COUNT_MAX {
            return Err(too_large(file, "triangles", count, MESH_COUNT_MAX as usize));
        }
        self.polygons += usize::from(rest.len() > 2);
        for pair in rest.windows(2) {
            let fan = [first, &pair[0], &pair[1]];
            let [mut triangle, mut textured] = [[0; 3], [UNTEXTURED; 3]];
            for (slot, corner) in fan.into_iter().enumerate() {
                triangle[slot] = self.vertex(file, place, corner.vertex)?;
                if let Some(index) = corner.texture {
                    let count = self.coordinates.len();
                    textured[slot] =
                        self.narrow(file, place, index, ("texture coordinate", count))?;
                }
            }
            self.triangles.push(triangle);
            self.texture_triangles.push(textured);
            self.numbers.push(u32::try_from(number).unwrap_or(u32::MAX));
        }
        Ok(())
    }

    /// Puts a vertex into the groups in force, which faces around it do not change.
    pub(super) fn member(
        &mut self,
        file: &str,
        number: usize,
        vertex: i64,
    ) -> Result<(), MeshError> {
        let vertex = self.vertex(file, (self.place)(number), vertex)?;
        // In no group: nobody will ask for it, but it has to exist.
        let set = self.runs.last().map_or(u32::MAX, |&(_, set)| set as u32);
        let number = u32::try_from(number).unwrap_or(u32::MAX);
        self.members.push(Member { vertex, number, set });
        Ok(())
    }

    fn vertex(&self, file: &str, place: MeshPlace, index: i64) -> Result<u32, MeshError> {
        self.narrow(file, place, index, ("vertex", self.positions.len()))
    }

    /// What no index can be is out of range whatever else the file holds.
    fn narrow(
        &self,
        file: &str,
        place: MeshPlace,
        index: i64,
        (what, count): (&'static str, usize),
    ) -> Result<u32, MeshError> {
        u32::try_from(index).ok().filter(|&index| index != UNTEXTURED).ok_or_else(|| {
            let (file, index) = (file.to_owned(), index.saturating_add(self.index_base));
            MeshError::Index { file, place, what, index, count }
        })
    }

    /// Checks everything and makes the mesh.
    pub(super) fn finish(self, file: &str) -> Result<TriangleMesh, MeshError> {
        self.check_sizes(file)?;
        let check = |triangles: &[[u32; 3]], count: usize, what: &'static str| {
            let outside = |&&index: &&u32| index as usize >= count && index != UNTEXTURED;
            let wrong = triangles.iter().position(|t| t.iter().any(|index| outside(&index)));
            let index = |wrong: usize| triangles[wrong].iter().find(outside).copied();
            match wrong.map(|wrong| (wrong, index(wrong).unwrap_or_default())) {
                None => Ok(()),
                Some((wrong, index)) => Err(MeshError::Index {
                    file: file.to_owned(),
                    place: (self.place)(self.numbers[wrong] as usize),
                    what,
                    index: i64::from(index) + self.index_base,
                    count,
                }),
            }
        };
        check(&self.triangles, self.positions.len(), "vertex")?;
        check(&self.texture_triangles, self.coordinates.len(), "texture coordinate")?;
        let count = self.positions.len();
        if let Some(member) = self.members.iter().find(|member| member.vertex as usize >= count) {
            return Err(MeshError::Index {
                file: file.to_owned(),
                place: (self.place)(member.number as usize),
                what: "vertex",
                index: i64::from(member.vertex) + self.index_base,
                count,
            });
        }
        let groups = self.groups();
        // A map that lacks some corners could not be indexed by triangle, so it is all or nothing.
        let textured = !self.texture_triangles.iter().flatten().any(|&index| index == UNTEXTURED);
        let texture = textured.then_some(TextureMap {
            coordinates: self.coordinates,
            triangles: self.texture_triangles,
        });
        let Self { positions, triangles, attributes, stitches, polygons, .. } = self;
        Ok(TriangleMesh {
            positions,
            triangles,
            texture,
            groups,
            attributes,
            stitches,
            polygons,
            ..TriangleMesh::default()
        })
    }

    fn check_sizes(&self, file: &str) -> Result<(), MeshError> {
        let vertices = self.positions.len();
        if vertices as u64 > MESH_COUNT_MAX {
            return Err(too_large(file, "vertices", vertices, MESH_COUNT_MAX as usize));
        }
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

    /// The vertices of each name. What many names have in common is gathered once, so that the time grows
    /// with the faces and with what comes out.
    fn groups(&self) -> Vec<VertexGroup> {
        let Names { list, sets, .. } = &self.names;
        let mut of_set: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); sets.len()];
        for (number, &(start, set)) in self.runs.iter().enumerate() {
            let end = self.runs.get(number + 1).map_or(self.triangles.len(), |&(start, _)| start);
            of_set[set].extend(self.triangles[start..end].iter().flatten());
        }
        for member in &self.members {
            if let Some(vertices) = of_set.get_mut(member.set as usize) {
                vertices.insert(member.vertex);
            }
        }
        let mut of_name: Vec<Vec<u32>> = vec![Vec::new(); list.len()];
        for (names, vertices) in sets.iter().zip(&of_set) {
            for &name in names {
                of_name[name as usize].extend(vertices);
            }
        }
        let mut groups = Vec::new();
        for (name, mut vertices) in list.iter().zip(of_name) {
            vertices.sort_unstable();
            vertices.dedup();
            if !vertices.is_empty() {
                groups.push(VertexGroup { name: name.clone(), vertices });
            }
        }
        groups
    }
}

/// The error for a mesh that asks for more than is read.
pub(super) fn too_large(
    file: &str,
    what: &'static str,
    declared: usize,
    limit: usize,
) -> MeshError {
    let [declared, limit] = [declared, limit].map(|count| count as u64);
    MeshError::TooLarge { file: file.to_owned(), what, declared, limit }
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
