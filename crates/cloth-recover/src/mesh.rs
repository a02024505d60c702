//! Which triangles an edge has, and which particles are next to each other.

use glam::DVec3;

use crate::Body;

/// An edge and its first two triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// Its particles, ascending.
    pub(crate) ends: [u32; 2],
    pub(crate) faces: [Option<u32>; 2],
    /// Triangles that have it.
    pub(crate) count: u32,
}

/// A surface.
pub(crate) struct Mesh<'a> {
    pub(crate) triangles: &'a [[u32; 3]],
    /// Ascending by their ends.
    pub(crate) edges: Vec<Edge>,
    /// Numbers of the edges of all particles, one after the other, and where those of each begin.
    around: Vec<u32>,
    begins: Vec<u32>,
    /// The first particle that each one is joined to.
    pieces: Vec<u32>,
}

impl<'a> Mesh<'a> {
    /// Triangles with an index that no particle has are left out, as the audit does.
    pub(crate) fn new(triangles: &'a [[u32; 3]], particles: usize) -> Self {
        let is_usable = |triangle: &[u32; 3]| triangle.iter().all(|&i| (i as usize) < particles);
        let mut sides: Vec<([u32; 2], u32)> = (0..)
            .zip(triangles)
            .filter(|(_, triangle)| is_usable(triangle))
            .flat_map(|(face, &[a, b, c])| [([a, b], face), ([b, c], face), ([c, a], face)])
            .map(|([a, b], face)| ([a.min(b), a.max(b)], face))
            .filter(|([a, b], _)| a != b)
            .collect();
        sides.sort_unstable();
        let mut edges: Vec<Edge> = Vec::with_capacity(sides.len() / 2);
        for (ends, face) in sides {
            match edges.last_mut() {
                Some(edge) if edge.ends == ends => {
                    if edge.count == 1 {
                        edge.faces[1] = Some(face);
                    }
                    edge.count += 1;
                }
                _ => edges.push(Edge { ends, faces: [Some(face), None], count: 1 }),
            }
        }
        let mut begins = vec![0; particles + 1];
        for edge in &edges {
            edge.ends.iter().for_each(|&end| begins[end as usize + 1] += 1);
        }
        for i in 0..particles {
            begins[i + 1] += begins[i];
        }
        let mut next = begins.clone();
        let mut around = vec![0; 2 * edges.len()];
        for (number, edge) in (0..).zip(&edges) {
            for end in edge.ends {
                around[next[end as usize] as usize] = number;
                next[end as usize] += 1;
            }
        }
        let mut mesh = Self { triangles, edges, around, begins, pieces: vec![] };
        mesh.pieces = mesh.pieces(particles);
        mesh
    }

    fn pieces(&self, particles: usize) -> Vec<u32> {
        let mut pieces = vec![u32::MAX; particles];
        for first in 0..particles as u32 {
            let mut next = vec![first];
            while let Some(particle) = next.pop() {
                if pieces[particle as usize] == u32::MAX {
                    pieces[particle as usize] = first;
                    next.extend(self.around(particle).map(|(_, other)| other));
                }
            }
        }
        pieces
    }

    /// The piece of a particle, by its first particle.
    pub(crate) fn piece_of(&self, particle: u32) -> u32 {
        self.pieces[particle as usize]
    }

    /// The number of an edge with these ends, ascending.
    pub(crate) fn find(&self, ends: [u32; 2]) -> Option<usize> {
        self.edges.binary_search_by_key(&ends, |edge| edge.ends).ok()
    }

    /// The edges of a particle by their numbers, each with its other end.
    pub(crate) fn around(&self, particle: u32) -> impl Iterator<Item = (usize, u32)> {
        let at = particle as usize;
        let range = self.begins[at] as usize..self.begins[at + 1] as usize;
        self.around[range].iter().map(move |&number| {
            let [a, b] = self.edges[number as usize].ends;
            (number as usize, if a == particle { b } else { a })
        })
    }

    /// The corners of the triangles of an edge that are not its ends, of an edge with two triangles.
    pub(crate) fn across(&self, edge: &Edge) -> Option<[u32; 2]> {
        let [Some(first), Some(second)] = edge.faces else { return None };
        let corner = |face: u32| {
            self.triangles[face as usize].into_iter().find(|corner| !edge.ends.contains(corner))
        };
        Some([corner(first)?, corner(second)?])
    }

    /// Whether every edge has two triangles, so that there is an inside.
    fn is_closed(&self) -> bool {
        !self.edges.is_empty() && self.edges.iter().all(|edge| edge.count == 2)
    }
}

/// A body and where its outside is.
pub(crate) struct Solid<'a> {
    pub(crate) body: &'a Body,
    pub(crate) mesh: Mesh<'a>,
    /// 1 or -1 if its triangles are seen counterclockwise or clockwise from outside, 0 if it is open.
    pub(crate) outside: f64,
}

impl<'a> Solid<'a> {
    fn new(body: &'a Body) -> Self {
        let mesh = Mesh::new(&body.triangles, body.positions.len());
        let volume = volume(&body.positions, &body.triangles);
        let outside = if mesh.is_closed() && volume != 0.0 { volume.signum() } else { 0.0 };
        Self { body, mesh, outside }
    }
}

/// The volume within a closed surface \[m^3\], negative if its triangles are seen clockwise from outside.
fn volume(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let corner = |i: u32| positions.get(i as usize).copied().map(DVec3::from).unwrap_or_default();
    let parts = triangles.iter().map(|&[a, b, c]| {
        let [a, b, c] = [a, b, c].map(corner);
        a.dot(b.cross(c)) / 6.0
    });
    parts.sum()
}

/// The cloth, surface 0, and the bodies, from surface 1 on.
pub(crate) struct Surfaces<'a> {
    pub(crate) cloth: Mesh<'a>,
    pub(crate) bodies: Vec<Solid<'a>>,
    /// Triangles of all surfaces before each.
    begins: Vec<u32>,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(triangles: &'a [[u32; 3]], particles: usize, bodies: &'a [Body]) -> Self {
        let cloth = Mesh::new(triangles, particles);
        let bodies: Vec<Solid<'_>> = bodies.iter().map(Solid::new).collect();
        let mut begins = vec![0, triangles.len() as u32];
        for body in &bodies {
            begins.push(begins[begins.len() - 1] + body.mesh.triangles.len() as u32);
        }
        Self { cloth, bodies, begins }
    }

    fn mesh(&self, surface: usize) -> &Mesh<'a> {
        surface.checked_sub(1).map_or(&self.cloth, |body| &self.bodies[body].mesh)
    }

    /// The number of a triangle among those of all surfaces.
    pub(crate) fn face(&self, surface: usize, triangle: u32) -> u32 {
        self.begins[surface] + triangle
    }

    /// The numbers of the triangles of an edge.
    pub(crate) fn faces_of(&self, surface: usize, ends: [u32; 2]) -> impl Iterator<Item = u32> {
        let mesh = self.mesh(surface);
        let faces = mesh.find(ends).map(|number| mesh.edges[number].faces).unwrap_or_default();
        faces.into_iter().flatten().map(move |face| self.face(surface, face))
    }

    /// The corners of a triangle, with cloth at `at`.
    pub(crate) fn corners(&self, at: &[DVec3], surface: usize, triangle: usize) -> [DVec3; 3] {
        self.mesh(surface).triangles[triangle].map(|i| self.point(at, surface, i))
    }

    pub(crate) fn point(&self, at: &[DVec3], surface: usize, i: u32) -> DVec3 {
        match surface.checked_sub(1) {
            None => at[i as usize],
            Some(body) => self.bodies[body].body.positions[i as usize].into(),
        }
    }

    /// The corners across an edge.
    pub(crate) fn across(
        &self,
        at: &[DVec3],
        surface: usize,
        ends: [u32; 2],
    ) -> impl Iterator<Item = DVec3> {
        let mesh = self.mesh(surface);
        let faces = mesh.find(ends).map(|number| mesh.edges[number].faces).unwrap_or_default();
        let corner = move |face: u32| {
            mesh.triangles[face as usize].into_iter().find(|corner| !ends.contains(corner))
        };
        let corners = faces.into_iter().flatten().filter_map(corner);
        corners.map(move |corner| self.point(at, surface, corner))
    }

    /// The normal at an edge: the mean of its triangles' normals.
    pub(crate) fn normal_at(&self, at: &[DVec3], surface: usize, ends: [u32; 2]) -> DVec3 {
        let mesh = self.mesh(surface);
        let faces = mesh.find(ends).map(|number| mesh.edges[number].faces).unwrap_or_default();
        let normals = faces.into_iter().flatten();
        let sum: DVec3 = normals.map(|face| normal(self.corners(at, surface, face as usize))).sum();
        sum.normalize_or_zero()
    }
}

/// The unit normal of a triangle; zero without area.
pub(crate) fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
