//! Vertices where a seam needs some: a stitch to a point on an edge becomes one to a vertex.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use cloth_core::{MeshStitch, TriangleMesh};

/// Nearer to a vertex than this share of its edge, a point is taken for the vertex: triangles stay wide.
const NEAR: f64 = 0.2;

/// Nearer than this share it is the vertex, whatever else is sewn to it.
const SAME: f64 = 1e-3;

/// Stitches between vertices of a mesh, which gets more vertices for them.
pub(super) struct Cutter<'a> {
    mesh: &'a mut TriangleMesh,
    /// Triangles of each edge, the smaller vertex first.
    faces: HashMap<[u32; 2], Vec<usize>>,
    /// Vertices on the edges of the mesh as it was, by the bits of their place from the smaller end.
    added: HashMap<[u32; 2], BTreeMap<u64, u32>>,
    /// The class of each vertex that is stitched, and its members.
    class: HashMap<u32, usize>,
    members: Vec<Vec<u32>>,
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl<'a> Cutter<'a> {
    pub(super) fn new(mesh: &'a mut TriangleMesh) -> Self {
        let mut faces: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            for side in [[a, b], [b, c], [c, a]] {
                faces.entry(sorted(side)).or_default().push(index);
            }
        }
        Self { mesh, faces, added: HashMap::new(), class: HashMap::new(), members: Vec::new() }
    }

    pub(super) fn mesh(&self) -> &TriangleMesh {
        self.mesh
    }

    /// Whether two vertices are the ends of an edge.
    pub(super) fn has_edge(&self, edge: [u32; 2]) -> bool {
        let edge = sorted(edge);
        self.faces.contains_key(&edge) || self.added.contains_key(&edge)
    }

    /// The edges of one triangle.
    pub(super) fn border(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.faces.iter().filter(|(_, faces)| faces.len() == 1).map(|(edge, _)| *edge)
    }

    fn class_of(&mut self, vertex: u32) -> usize {
        let Self { class, members, .. } = self;
        *class.entry(vertex).or_insert_with(|| {
            members.push(vec![vertex]);
            members.len() - 1
        })
    }

    /// Whether an edge would lose its length if two vertices were one.
    fn collapses(&mut self, a: u32, b: u32) -> bool {
        let [a, b] = [self.class_of(a), self.class_of(b)];
        let pairs =
            self.members[a].iter().flat_map(|&i| self.members[b].iter().map(move |&j| [i, j]));
        a != b && pairs.into_iter().any(|pair| self.faces.contains_key(&sorted(pair)))
    }

    /// Joins what a stitch to a vertex joins, unless two ends of an edge would be one with all that was joined before; says whether it did. A stitch
    /// to a place between makes a vertex later, and always can.
    pub(super) fn joins(&mut self, stitch: &MeshStitch) -> bool {
        let MeshStitch { vertex, edge, place, .. } = *stitch;
        let end = match place {
            _ if edge[0] == edge[1] || place <= SAME => edge[0],
            _ if place >= 1.0 - SAME => edge[1],
            _ => return true,
        };
        let joins = !self.collapses(vertex, end);
        if joins {
            self.join(vertex, end);
        }
        joins
    }

    /// Notes that two vertices are stitched.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let [a, b] = [self.class_of(a), self.class_of(b)];
        if a != b {
            let moved = std::mem::take(&mut self.members[b]);
            moved.iter().for_each(|vertex| {
                self.class.insert(*vertex, a);
            });
            self.members[a].extend(moved);
        }
    }

    /// Makes room between triangles that would lie on each other for good, as seams make all their corners one: at a tip that is sewn to itself, at
    /// the bottom of a pleat, where the corners of two panels meet.
    ///
    /// Their edges within the panel get a vertex in the middle each, but for an edge that both have, which is the fold. So the tip becomes a small
    /// cone, with all of its area and mass.
    pub(super) fn tips_open(&mut self) {
        let mut same: BTreeMap<[u32; 3], Vec<usize>> = BTreeMap::new();
        for (face, corners) in self.mesh.triangles.iter().enumerate() {
            let mut key =
                corners.map(|v| self.class.get(&v).map_or(v, |&class| self.members[class][0]));
            key.sort_unstable();
            same.entry(key).or_default().push(face);
        }
        let mut edges = BTreeSet::new();
        for faces in same.into_values().filter(|faces| faces.len() > 1) {
            for &face in &faces {
                let [a, b, c] = self.mesh.triangles[face];
                for edge in [[a, b], [b, c], [c, a]].map(sorted) {
                    let on = self.faces.get(&edge).map_or(&[][..], Vec::as_slice);
                    if on.len() > 1 && on.iter().filter(|&face| faces.contains(face)).count() < 2 {
                        edges.insert(edge);
                    }
                }
            }
        }
        edges.into_iter().for_each(|edge| {
            self.split(edge, 0.5);
        });
    }

    /// The vertex to which `vertex` is sewn that is sewn to `place` on an edge, from 0 to 1. It is new unless one is near.
    pub(super) fn point(&mut self, vertex: u32, edge: [u32; 2], place: f64) -> u32 {
        let ends = sorted(edge);
        let place = if ends == edge { place } else { 1.0 - place };
        let on = self.added.get(&ends);
        let below = on.and_then(|on| on.range(..=place.to_bits()).next_back());
        let above = on.and_then(|on| on.range(place.to_bits()..).next());
        let low = below.map_or((0.0, ends[0]), |(&bits, &vertex)| (f64::from_bits(bits), vertex));
        let high = above.map_or((1.0, ends[1]), |(&bits, &vertex)| (f64::from_bits(bits), vertex));
        let (way, near) = [(place - low.0, low.1), (high.0 - place, high.1)]
            .into_iter()
            .fold((f64::INFINITY, low.1), |best, end| if end.0 < best.0 { end } else { best });
        let found = if way <= SAME || (way <= NEAR && !self.collapses(vertex, near)) {
            near
        } else {
            let part = (place - low.0) / (high.0 - low.0);
            let made = self.split([low.1, high.1], part);
            self.added.entry(ends).or_default().insert(place.to_bits(), made);
            made
        };
        self.join(vertex, found);
        found
    }

    /// Puts a vertex on an edge, at a part of it from its first end, and divides its triangles.
    fn split(&mut self, [v, w]: [u32; 2], part: f64) -> u32 {
        let made = self.mesh.positions.len() as u32;
        let mix = |a: f64, b: f64| a + part * (b - a);
        let [a, b] = [v, w].map(|end| self.mesh.positions[end as usize]);
        self.mesh.positions.push(std::array::from_fn(|k| mix(a[k], b[k])));
        for attribute in &mut self.mesh.attributes {
            let [a, b] = [v, w].map(|end| f64::from(attribute.values[end as usize]));
            attribute.values.push(mix(a, b) as f32);
        }
        for group in &mut self.mesh.groups {
            if [v, w].iter().all(|end| group.vertices.binary_search(end).is_ok()) {
                group.vertices.push(made);
            }
        }
        for face in self.faces.remove(&sorted([v, w])).unwrap_or_default() {
            self.face_split(face, [v, w], made, part);
        }
        made
    }

    fn face_split(&mut self, face: usize, [v, w]: [u32; 2], made: u32, part: f64) {
        let corners = self.mesh.triangles[face];
        // The edge runs from corner k to the next.
        let Some(k) =
            (0..3).find(|&k| sorted([corners[k], corners[(k + 1) % 3]]) == sorted([v, w]))
        else {
            return;
        };
        let (next, last) = ((k + 1) % 3, (k + 2) % 3);
        let added = self.mesh.triangles.len();
        let mut other = corners;
        self.mesh.triangles[face][next] = made;
        other[k] = made;
        self.mesh.triangles.push(other);
        if let Some(texture) = &mut self.mesh.texture
            && let Some(&names) = texture.triangles.get(face)
        {
            let [a, b] = if corners[k] == v { [k, next] } else { [next, k] };
            let ends = [a, b].map(|k| texture.coordinates.get(names[k] as usize).copied());
            let [a, b] = ends.map(Option::unwrap_or_default);
            let name = texture.coordinates.len() as u32;
            texture.coordinates.push(std::array::from_fn(|i| a[i] + part * (b[i] - a[i])));
            let mut other = names;
            texture.triangles[face][next] = name;
            other[k] = name;
            texture.triangles.push(other);
        }
        if let Some(&angle) = self.mesh.grain.get(face) {
            self.mesh.grain.push(angle);
        }
        if let Some(&fabric) = self.mesh.panels.triangles.get(face) {
            self.mesh.panels.triangles.push(fabric);
        }
        let mut put = |edge: [u32; 2], from: Option<usize>, to: usize| {
            let faces = self.faces.entry(sorted(edge)).or_default();
            match from.and_then(|from| faces.iter().position(|&face| face == from)) {
                Some(place) => faces[place] = to,
                None => faces.push(to),
            }
        };
        put([corners[k], made], None, face);
        put([made, corners[next]], None, added);
        put([corners[next], corners[last]], Some(face), added);
        put([made, corners[last]], None, face);
        put([made, corners[last]], None, added);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cloth_core::{TextureMap, VertexGroup};

    #[test]
    fn points_on_an_edge_divide_its_triangle_and_keep_its_area_and_pattern() {
        let triangles = vec![[0, 1, 2]];
        let mut mesh = TriangleMesh {
            positions: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [5.0, 0.0, 0.0],
                [6.0, 0.0, 0.0],
            ],
            texture: Some(TextureMap {
                coordinates: vec![[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]],
                triangles: triangles.clone(),
            }),
            triangles,
            groups: vec![VertexGroup { name: "low".into(), vertices: vec![0, 1] }],
            ..TriangleMesh::default()
        };
        let mut cutter = Cutter::new(&mut mesh);
        let found = [
            cutter.point(3, [1, 0], 0.25),
            cutter.point(4, [0, 1], 0.25),
            cutter.point(4, [0, 1], 0.05),
        ];
        // Vertex 4 is sewn to vertex 6, whose edge to 0 would have no length if 0 were sewn to it too.
        assert_eq!(found[..2], [5, 6]);
        assert_ne!(found[2], 0);
        assert_eq!(mesh.positions[5], [0.75, 0.0, 0.0]);
        assert_eq!(mesh.groups[0].vertices, [0, 1, 5, 6, 7]);
        let area = |t: &[u32; 3], at: &dyn Fn(u32) -> [f64; 2]| {
            let [a, b, c] = t.map(at);
            0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        };
        let place = |i: u32| [mesh.positions[i as usize][0], mesh.positions[i as usize][1]];
        let areas: Vec<f64> = mesh.triangles.iter().map(|t| area(t, &place)).collect();
        assert!(areas.iter().all(|&area| area > 0.0), "{areas:?}");
        assert!((areas.iter().sum::<f64>() - 0.5).abs() < 1e-15);
        let texture = mesh.texture.unwrap();
        let uv = |i: u32| texture.coordinates[i as usize];
        let areas: Vec<f64> = texture.triangles.iter().map(|t| area(t, &uv)).collect();
        assert!((areas.iter().sum::<f64>() - 2.0).abs() < 1e-15, "{areas:?}");
    }

    #[test]
    fn tips_that_would_be_two_triangles_in_one_place_become_cones() {
        // A kite around vertex 0, whose two sides there are sewn to each other; below the kite the panel goes on.
        let triangles = vec![[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 5], [2, 5, 3]];
        let positions: Vec<[f64; 3]> =
            [[0.0, 2.0], [-1.0, 1.0], [0.0, 0.5], [1.0, 1.0], [-1.0, 0.0], [1.0, 0.0]]
                .map(|[x, y]| [x, y, 0.0])
                .into();
        let panel = TriangleMesh { positions, triangles, ..TriangleMesh::default() };
        let welded = |is_opened: bool| {
            let mut mesh = panel.clone();
            let mut cutter = Cutter::new(&mut mesh);
            cutter.join(1, 3);
            if is_opened {
                cutter.tips_open();
            }
            let triangles = mesh.triangles.iter().map(|t| t.map(|v| if v == 3 { 1 } else { v }));
            let triangles: Vec<[u32; 3]> = triangles.collect();
            TriangleMesh { triangles, ..mesh }
        };
        let sorted = |mesh: &TriangleMesh| {
            let mut all: Vec<[u32; 3]> = mesh.triangles.clone();
            all.iter_mut().for_each(|triangle| triangle.sort_unstable());
            all.sort_unstable();
            all
        };
        let twice = |all: &[[u32; 3]]| all.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert_eq!(twice(&sorted(&welded(false))), 1, "what is to be mended");
        let mesh = welded(true);
        assert_eq!(twice(&sorted(&mesh)), 0);
        assert_eq!(mesh.positions.len(), panel.positions.len() + 2);
        assert_eq!(mesh.triangles.len(), panel.triangles.len() + 4);
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for side in [[a, b], [b, c], [c, a]] {
                *edges.entry(super::sorted(side)).or_default() += 1;
            }
        }
        assert!(edges.values().all(|&triangles| triangles <= 2), "{edges:?}");
    }

    #[test]
    fn stitches_that_would_take_the_length_of_an_edge_do_not_join() {
        let mut mesh = TriangleMesh {
            positions: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [5.0, 0.0, 0.0],
                [6.0, 0.0, 0.0],
            ],
            triangles: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        };
        let mut cutter = Cutter::new(&mut mesh);
        let mut joins =
            |vertex, edge, place| cutter.joins(&MeshStitch { vertex, edge, place, seam: 0 });
        assert!(joins(3, [0, 0], 0.0));
        assert!(!joins(3, [1, 1], 0.0), "0 and 1 would be one");
        assert!(!joins(3, [1, 2], 1.0), "0 and 2 would be one");
        assert!(!joins(0, [1, 2], 0.0), "an edge of its own");
        assert!(joins(3, [1, 2], 0.5), "there is a vertex to be made");
        assert!(joins(4, [1, 2], 1.0), "nothing was joined to it");
    }
}
