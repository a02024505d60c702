//! `contact_groups`: triangles in groups that lie close together at the start, with the edges and vertices that belong to them.

use std::ops::Range;

use cloth_core::{Real, contact::ContactSurface};
use rayon::prelude::*;

use super::{
    bounds::{Bounds, Ends},
    packet::{ALL, LANES, Mask, Packet},
    tree::Tree,
};

/// Packets that one task looks at.
const PACKETS_OF_TASK: usize = 64;

/// Groups of triangles with what belongs to them, one after the other, and a tree of boxes around them. Each edge and each vertex belongs to one
/// triangle.
#[derive(Debug)]
pub(super) struct Groups<T> {
    /// One packet for each group.
    triangles: Vec<Packet<T, 3>>,
    edges: Vec<Packet<T, 2>>,
    vertices: Vec<u32>,
    /// Where the edges and the vertices of each group begin, and where those of the last one end.
    starts: Vec<[u32; 2]>,
    /// The triangles, and the edges, of each packet that have a marked corner; all where nobody asks for marks.
    triangle_marks: Vec<Mask>,
    edge_marks: Vec<Mask>,
    /// The vertices, and the ways that boxes are around: bodies often rest.
    own: Range<usize>,
    ways: Vec<Ends<T>>,
    pub(super) tree: Tree<T>,
}

/// A group.
pub(super) struct Group<'a, T> {
    pub(super) triangles: &'a Packet<T, 3>,
    pub(super) edges: &'a [Packet<T, 2>],
    pub(super) vertices: &'a [u32],
    pub(super) triangle_marks: Mask,
    pub(super) edge_marks: &'a [Mask],
    /// The box around it.
    pub(super) bounds: &'a Bounds<T, 8>,
}

/// Packets of edges in a group at most: three for each triangle.
pub(super) const EDGE_PACKETS: usize = 3;

impl<T: Real> Groups<T> {
    /// The triangles of cloths.
    pub(super) fn of_cloths(surface: &ContactSurface) -> Self {
        Self::new(surface, &surface.groups(LANES))
    }

    /// Those of bodies.
    pub(super) fn of_bodies(surface: &ContactSurface) -> Self {
        Self::new(surface, &surface.body_groups(LANES))
    }

    fn new(surface: &ContactSurface, order: &[u32]) -> Self {
        let (mut triangles, mut edges, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
        let mut starts = vec![[0; 2]];
        let corners = order.iter().flat_map(|&t| surface.triangles()[t as usize]);
        let first = corners.clone().min().unwrap_or(0) as usize;
        let end = corners.max().map_or(0, |last| last as usize + 1);
        for own in order.chunks(LANES) {
            triangles.push(Packet::new(surface, own, surface.triangles()));
            let mut of_group = Vec::new();
            for &triangle in own {
                let (owned, of_triangle) = surface.features(triangle);
                let corners = surface.triangles()[triangle as usize];
                vertices.extend((0..3).filter(|k| owned >> k & 1 == 1).map(|k| corners[k]));
                of_group
                    .extend((0..3).filter(|k| owned >> (3 + k) & 1 == 1).map(|k| of_triangle[k]));
            }
            let packet = |own| Packet::new(surface, own, surface.edges());
            edges.extend(of_group.chunks(LANES).map(packet));
            starts.push([edges.len() as u32, vertices.len() as u32]);
        }
        Self {
            triangle_marks: vec![ALL; triangles.len()],
            edge_marks: vec![ALL; edges.len()],
            own: first..end,
            ways: Vec::new(),
            tree: Tree::new(triangles.len()),
            triangles,
            edges,
            vertices,
            starts,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.triangles.len()
    }

    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> Group<'_, T> {
        let ([edges, vertices], ends) = (self.starts[group], self.starts[group + 1]);
        let edges = edges as usize..ends[0] as usize;
        Group {
            triangles: &self.triangles[group],
            edges: &self.edges[edges.clone()],
            vertices: &self.vertices[vertices as usize..ends[1] as usize],
            triangle_marks: self.triangle_marks[group],
            edge_marks: &self.edge_marks[edges],
            bounds: self.tree.bounds(group),
        }
    }

    /// Puts boxes around features, whose vertices have these ways.
    pub(super) fn refit(
        &mut self,
        surface: &ContactSurface,
        vertices: &[Ends<T>],
        arch: pulp::Arch,
    ) {
        let own = &vertices[self.own.clone()];
        if self.ways == own {
            return;
        }
        self.ways.clear();
        self.ways.extend_from_slice(own);
        let leaves = self.tree.leaves().par_iter_mut().zip(&mut self.triangles);
        leaves.with_min_len(PACKETS_OF_TASK).for_each(|(bounds, packet)| {
            *bounds = arch.dispatch(Refit { packet, vertices, corners: surface.triangles() });
        });
        self.edges.par_iter_mut().with_min_len(PACKETS_OF_TASK).for_each(|packet| {
            arch.dispatch(Refit { packet, vertices, corners: surface.edges() });
        });
        self.tree.refit();
    }

    /// Takes in which vertices are marked; all, if nobody says so.
    pub(super) fn mark(&mut self, surface: &ContactSurface, marked: Option<&[bool]>) {
        fn set<T: Real, const CORNERS: usize>(
            (marks, packets): (&mut [Mask], &[Packet<T, CORNERS>]),
            marked: Option<&[bool]>,
            corners: &[[u32; CORNERS]],
        ) {
            let Some(marked) = marked else { return marks.fill(ALL) };
            let both = marks.par_iter_mut().zip(packets).with_min_len(PACKETS_OF_TASK);
            both.for_each(|(marks, packet)| *marks = packet.marks(marked, corners));
        }
        let Self { triangles, edges, triangle_marks, edge_marks, tree, .. } = self;
        set((triangle_marks, triangles), marked, surface.triangles());
        set((edge_marks, edges), marked, surface.edges());
        // Each particle is a corner of a triangle.
        for (has, marks) in tree.leaf_marks().iter_mut().zip(&*triangle_marks) {
            *has = *marks != 0;
        }
        tree.mark();
    }
}

/// Puts boxes around the features of a packet, compiled for each instruction set.
struct Refit<'a, T, const CORNERS: usize> {
    packet: &'a mut Packet<T, CORNERS>,
    vertices: &'a [Ends<T>],
    corners: &'a [[u32; CORNERS]],
}

impl<T: Real, const CORNERS: usize> pulp::NullaryFnOnce for Refit<'_, T, CORNERS> {
    type Output = Bounds<T, 8>;

    #[inline(always)]
    fn call(self) -> Bounds<T, 8> {
        self.packet.refit(self.vertices, self.corners)
    }
}
