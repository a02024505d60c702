//! `contact_groups`: triangles in groups that lie close together at the start, and boxes around them in a binary tree, at the start and at the
//! end of their ways.

use cloth_core::{Real, contact::ContactSurface};
use rayon::prelude::*;

/// Triangles in a group.
pub(super) const GROUP: usize = 8;

/// A point, or an axis of a box for each of its coordinates. The fourth is zero: four fill a vector register.
pub(super) type Padded<T> = [T; 4];

#[inline(always)]
pub(super) fn padded<T: Real>([x, y, z]: [T; 3]) -> Padded<T> {
    [x, y, z, T::ZERO]
}

/// Two points of a way, [`Padded`] and side by side.
pub(super) type Ends<T> = [T; 8];

#[inline(always)]
pub(super) fn ends<T: Real>([x, y, z]: [T; 3], [u, v, w]: [T; 3]) -> Ends<T> {
    [x, y, z, T::ZERO, u, v, w, T::ZERO]
}

/// A box with sides along the axes, or one for each end of some ways.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds<T, const SIDES: usize> {
    pub(super) low: [T; SIDES],
    pub(super) high: [T; SIDES],
}

impl<T: Real, const SIDES: usize> Bounds<T, SIDES> {
    /// No box: it is apart from all.
    const EMPTY: Self = Self { low: [T::INFINITY; SIDES], high: [T::MAX; SIDES] };

    /// Around some points, or ends of ways.
    #[inline(always)]
    pub(super) fn around<const N: usize>(points: [[T; SIDES]; N]) -> Self {
        let mut bounds = Self { low: points[0], high: points[0] };
        for point in &points[1..] {
            bounds = bounds.join(&Self { low: *point, high: *point });
        }
        bounds
    }

    /// Around two boxes, none of them empty.
    #[inline(always)]
    pub(super) fn join(mut self, other: &Self) -> Self {
        for side in 0..SIDES {
            self.low[side] = self.low[side].minimum(other.low[side]);
            self.high[side] = self.high[side].maximum(other.high[side]);
        }
        self
    }

    #[inline(always)]
    fn with(self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => *other,
            (_, true) => self,
            _ => self.join(other),
        }
    }

    #[inline(always)]
    fn is_empty(&self) -> bool {
        self.low[0] == T::INFINITY
    }
}

impl<T: Real> Bounds<T, 4> {
    /// Whether along some axis it is `reach`, which is not zero, or more away from another.
    #[inline(always)]
    pub(super) fn is_apart(&self, other: &Self, reach: T) -> bool {
        let mut apart = [false; 4];
        for axis in 0..4 {
            apart[axis] = (self.low[axis] - other.high[axis] >= reach)
                | (other.low[axis] - self.high[axis] >= reach);
        }
        apart[0] | apart[1] | apart[2] | apart[3]
    }
}

impl<T: Real> Bounds<T, 8> {
    /// Whether along some axis, on the same side of it at both ends of their ways, it is `reach`, which is not zero, or more away from another: then
    /// it is so all the way, however far both go together.
    #[inline(always)]
    pub(super) fn is_apart(&self, other: &Self, reach: T) -> bool {
        let (mut above, mut below) = ([false; 8], [false; 8]);
        for side in 0..8 {
            above[side] = self.low[side] - other.high[side] >= reach;
            below[side] = other.low[side] - self.high[side] >= reach;
        }
        let mut apart = [false; 4];
        for axis in 0..4 {
            apart[axis] = (above[axis] & above[4 + axis]) | (below[axis] & below[4 + axis]);
        }
        apart[0] | apart[1] | apart[2] | apart[3]
    }
}

/// Groups of triangles, and the boxes around them at both ends of their ways.
#[derive(Debug)]
pub(super) struct Tree<T> {
    /// Triangles, group by group.
    order: Vec<u32>,
    /// Around each triangle, in that order.
    triangles: Vec<Bounds<T, 8>>,
    /// A heap: children of node k are 2 k and 2 k + 1, and groups are its last nodes.
    nodes: Vec<Bounds<T, 8>>,
}

impl<T: Real> Tree<T> {
    /// The triangles of cloths, sorted by where they start.
    pub(super) fn of_cloths(surface: &ContactSurface) -> Self {
        Self::new(surface.groups(GROUP))
    }

    /// Those of bodies.
    pub(super) fn of_bodies(surface: &ContactSurface) -> Self {
        Self::new(surface.body_groups(GROUP))
    }

    fn new(order: Vec<u32>) -> Self {
        let groups = order.len().div_ceil(GROUP).next_power_of_two();
        Self {
            triangles: vec![Bounds::EMPTY; order.len()],
            nodes: vec![Bounds::EMPTY; 2 * groups],
            order,
        }
    }

    /// Groups, some of which are empty at the end.
    pub(super) fn groups(&self) -> usize {
        self.nodes.len() / 2
    }

    /// The triangles of a group, with the boxes around them.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> (&[u32], &[Bounds<T, 8>]) {
        let start = (group * GROUP).min(self.order.len());
        let end = (start + GROUP).min(self.order.len());
        (&self.order[start..end], &self.triangles[start..end])
    }

    /// Puts boxes around triangles, whose vertices have these ways.
    pub(super) fn refit(&mut self, surface: &ContactSurface, vertices: &[Ends<T>]) {
        let Self { order, triangles, nodes } = self;
        let groups = nodes.len() / 2;
        let (inner, leaves) = nodes.split_at_mut(groups);
        leaves
            .par_iter_mut()
            .zip(triangles.par_chunks_mut(GROUP).zip(order.par_chunks(GROUP)))
            .with_min_len(64)
            .for_each(|(node, (triangles, order))| {
                *node = Bounds::EMPTY;
                for (bounds, &triangle) in triangles.iter_mut().zip(order) {
                    let corners = surface.triangles()[triangle as usize];
                    let [a, b, c] = corners;
                    let [a, b, c] =
                        [vertices[a as usize], vertices[b as usize], vertices[c as usize]];
                    *bounds = Bounds::around([a, b, c]);
                    *node = node.with(bounds);
                }
            });
        for k in (1..groups).rev() {
            let child = |k: usize, inner: &[Bounds<T, 8>]| {
                if k < groups { inner[k] } else { leaves[k - groups] }
            };
            let [left, right] = [child(2 * k, inner), child(2 * k + 1, inner)];
            inner[k] = left.with(&right);
        }
    }

    /// For each group the triangles that have a marked particle, a bit for each.
    pub(super) fn marks(&self, surface: &ContactSurface, marked: &[bool]) -> Vec<u8> {
        let is_marked = |&triangle: &u32| {
            surface.triangles()[triangle as usize].iter().any(|&i| marked[i as usize])
        };
        let of = |group: usize| {
            let triangles = self.group(group).0.iter().enumerate();
            triangles.fold(0, |marks, (k, triangle)| marks | u8::from(is_marked(triangle)) << k)
        };
        (0..self.groups()).into_par_iter().with_min_len(64).map(of).collect()
    }

    /// The box around a group.
    #[inline(always)]
    pub(super) fn bounds(&self, group: usize) -> &Bounds<T, 8> {
        &self.nodes[self.groups() + group]
    }

    /// Visits the groups of a tree whose boxes are closer to `own`, that of a group of another tree, than `reach`, ascending.
    #[inline(always)]
    pub(super) fn near_bounds(&self, own: &Bounds<T, 8>, reach: T, mut visit: impl FnMut(usize)) {
        let groups = self.groups();
        if own.is_empty() {
            return;
        }
        let mut stack = [0_usize; 66];
        let mut depth = 1;
        stack[0] = 1;
        while depth > 0 {
            depth -= 1;
            let node = stack[depth];
            let bounds = &self.nodes[node];
            if bounds.is_empty() || own.is_apart(bounds, reach) {
                continue;
            }
            if node >= groups {
                visit(node - groups);
                continue;
            }
            stack[depth] = 2 * node + 1;
            stack[depth + 1] = 2 * node;
            depth += 2;
        }
    }

    /// Visits the groups from `group` on whose boxes are closer to that of `group` than `reach`, ascending.
    #[inline(always)]
    pub(super) fn near(&self, group: usize, reach: T, mut visit: impl FnMut(usize)) {
        let groups = self.groups();
        let own = self.nodes[groups + group];
        if own.is_empty() {
            return;
        }
        // One node of each level waits at most, and the root.
        let mut stack = [0_usize; 66];
        let mut depth = 1;
        stack[0] = 1;
        while depth > 0 {
            depth -= 1;
            let node = stack[depth];
            let bounds = &self.nodes[node];
            if bounds.is_empty() || own.is_apart(bounds, reach) {
                continue;
            }
            if node >= groups {
                if node - groups >= group {
                    visit(node - groups);
                }
                continue;
            }
            let level = groups.ilog2() - (2 * node + 1).ilog2();
            let last = (((2 * node + 1) + 1) << level) - 1 - groups;
            let last_left = (((2 * node) + 1) << level) - 1 - groups;
            if last >= group {
                stack[depth] = 2 * node + 1;
                depth += 1;
            }
            if last_left >= group {
                stack[depth] = 2 * node;
                depth += 1;
            }
        }
    }
}
