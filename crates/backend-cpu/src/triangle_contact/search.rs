//! The pairs of features that are near each other, group by group.

use std::{
    ops::Range,
    sync::atomic::{AtomicU64, Ordering},
};

use cloth_core::{
    Real,
    contact::{Candidate, ContactSurface, UnprovenPair},
};
use pulp::NullaryFnOnce;

use super::{
    bounds::{Bounds, Ends},
    groups::{EDGE_PACKETS, Group, Groups},
    packet::{ALL, behind, next},
    pairs::{PAIRS_MAX, Run},
};

/// What all tasks of a search have in common.
pub(super) struct Search<'a, T> {
    pub(super) surface: &'a ContactSurface,
    pub(super) cloths: &'a Groups<T>,
    pub(super) bodies: &'a Groups<T>,
    /// Ways of vertices.
    pub(super) vertices: &'a [Ends<T>],
    /// Which vertices are marked: pairs without one are left out.
    pub(super) marked: Option<&'a [bool]>,
    /// Along an axis, what is this far apart at both ends of ways is no pair \[m\].
    pub(super) reach: T,
    /// How many pairs there are, of all tasks.
    pub(super) total: AtomicU64,
}

/// Finds the pairs of some groups of cloths, compiled for each instruction set.
pub(super) struct SearchTask<'a, T> {
    pub(super) search: &'a Search<'a, T>,
    pub(super) groups: Range<usize>,
    pub(super) run: &'a mut Run,
}

impl<T: Real> NullaryFnOnce for SearchTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { search, groups, run } = self;
        let Search { cloths, bodies, reach, total, .. } = search;
        for number in groups {
            let own = cloths.group(number);
            let is_of_marks = own.triangle_marks == 0;
            let mut near = cloths.tree.near(*own.bounds, (number, *reach), is_of_marks);
            while let Some(other) = near.next() {
                if total.load(Ordering::Relaxed) <= PAIRS_MAX {
                    search.between([&own, &cloths.group(other)], number == other, run);
                }
            }
            let mut near = bodies.tree.near(*own.bounds, (0, *reach), is_of_marks);
            while let Some(other) = near.next() {
                if total.load(Ordering::Relaxed) <= PAIRS_MAX {
                    search.between([&own, &bodies.group(other)], false, run);
                }
            }
        }
        total.fetch_add(run.len(), Ordering::Relaxed);
    }
}

impl<T: Real> Search<'_, T> {
    /// The pairs of two groups, or of one with itself.
    #[inline(always)]
    fn between(&self, [a, b]: [&Group<'_, T>; 2], is_one: bool, run: &mut Run) {
        self.vertices_and_triangles(a, b, run);
        if !is_one {
            self.vertices_and_triangles(b, a, run);
        }
        self.edges(a, b, is_one, run);
    }

    #[inline(always)]
    fn vertices_and_triangles(&self, own: &Group<'_, T>, other: &Group<'_, T>, run: &mut Run) {
        for &vertex in own.vertices {
            let place = self.vertices[vertex as usize];
            let place = Bounds { low: place, high: place };
            if place.is_apart(other.bounds, self.reach) {
                continue;
            }
            let is_marked = self.marked.is_none_or(|marked| marked[vertex as usize]);
            let class = self.surface.classes()[vertex as usize];
            let gaps = other.triangles.less([class], other.triangles.gaps(&place));
            let mut near = gaps.below(self.reach);
            near &= if is_marked { ALL } else { other.triangle_marks };
            while let Some(lane) = next(&mut near) {
                let triangle = other.triangles.feature(lane);
                let [a, b, c] = self.surface.triangles()[triangle as usize];
                run.vertex_triangle.push(UnprovenPair {
                    candidate: Candidate::VertexTriangle([vertex, triangle]),
                    particles: [vertex, a, b, c],
                });
            }
        }
    }

    #[inline(always)]
    fn edges(&self, own: &Group<'_, T>, other: &Group<'_, T>, is_one: bool, run: &mut Run) {
        // Of two groups that touch most edges are far from the other group as a whole.
        let mut near_own = [0; EDGE_PACKETS];
        for (near, edges) in near_own.iter_mut().zip(other.edges) {
            *near = edges.gaps(own.bounds).below(self.reach);
        }
        for (number, edges) in own.edges.iter().enumerate() {
            let mut near_other = edges.gaps(other.bounds).below(self.reach);
            while let Some(lane) = next(&mut near_other) {
                let (bounds, classes) = (edges.bounds(lane), edges.classes(lane));
                let is_marked = own.edge_marks[number] >> lane & 1 == 1;
                let from = if is_one { number } else { 0 };
                for (k, others) in other.edges.iter().enumerate().skip(from) {
                    let mut near = near_own[k] & if is_marked { ALL } else { other.edge_marks[k] };
                    if is_one && k == number {
                        near &= behind(lane);
                    }
                    if near == 0 {
                        continue;
                    }
                    let gaps = others.less(classes, others.gaps(&bounds));
                    near &= gaps.below(self.reach);
                    while let Some(other) = next(&mut near) {
                        self.edge_edge([edges.feature(lane), others.feature(other)], run);
                    }
                }
            }
        }
    }

    /// Adds a pair of edges, the smaller number first.
    #[inline(always)]
    fn edge_edge(&self, [first, second]: [u32; 2], run: &mut Run) {
        let (first, second) = (first.min(second), first.max(second));
        let [p, q] = self.surface.edges()[first as usize];
        let [r, s] = self.surface.edges()[second as usize];
        let candidate = Candidate::EdgeEdge([first, second]);
        run.edge_edge.push(UnprovenPair { candidate, particles: [p, q, r, s] });
    }
}
