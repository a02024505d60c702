//! A binary tree of boxes around groups of triangles.

use cloth_core::Real;

use super::bounds::Bounds;

/// Levels of a tree at most.
const LEVELS: usize = 33;

/// A heap: children of node k are 2 k and 2 k + 1, and groups are its last nodes.
#[derive(Debug)]
pub(super) struct Tree<T> {
    nodes: Vec<Bounds<T, 8>>,
    /// Whether anything in a node is marked; of the present marks.
    marked: Vec<bool>,
}

impl<T: Real> Tree<T> {
    pub(super) fn new(groups: usize) -> Self {
        let nodes = 2 * groups.next_power_of_two();
        Self { nodes: vec![Bounds::EMPTY; nodes], marked: vec![false; nodes] }
    }

    /// The box around a group.
    #[inline(always)]
    pub(super) fn bounds(&self, group: usize) -> &Bounds<T, 8> {
        &self.nodes[self.nodes.len() / 2 + group]
    }

    /// Boxes around groups, to be set before [`Self::refit`]; some have none at the end.
    pub(super) fn leaves(&mut self) -> &mut [Bounds<T, 8>] {
        let groups = self.nodes.len() / 2;
        &mut self.nodes[groups..]
    }

    /// Whether groups have marks, to be set before [`Self::mark`].
    pub(super) fn leaf_marks(&mut self) -> &mut [bool] {
        let groups = self.nodes.len() / 2;
        &mut self.marked[groups..]
    }

    /// Puts boxes around those of groups.
    pub(super) fn refit(&mut self) {
        for k in (1..self.nodes.len() / 2).rev() {
            self.nodes[k] = self.nodes[2 * k].with(&self.nodes[2 * k + 1]);
        }
    }

    /// Marks what has marked groups.
    pub(super) fn mark(&mut self) {
        for k in (1..self.nodes.len() / 2).rev() {
            self.marked[k] = self.marked[2 * k] | self.marked[2 * k + 1];
        }
    }

    /// The groups from `first` on whose boxes are closer to `own` than `reach`, ascending; with marks alone, if these are asked for.
    #[inline(always)]
    pub(super) fn near(
        &self,
        own: Bounds<T, 8>,
        (first, reach): (usize, T),
        is_of_marks: bool,
    ) -> Near<'_, T> {
        let depth = usize::from(!own.is_empty());
        let mut stack = [0; LEVELS];
        stack[0] = 1;
        Near { tree: self, own, first, reach, is_of_marks, stack, depth }
    }
}

/// Groups of a tree that are near a box.
pub(super) struct Near<'a, T> {
    tree: &'a Tree<T>,
    own: Bounds<T, 8>,
    first: usize,
    reach: T,
    is_of_marks: bool,
    /// One node of each level waits at most, and the root.
    stack: [u32; LEVELS],
    depth: usize,
}

impl<T: Real> Near<'_, T> {
    /// The next one. (No iterator: its methods are calls of their own, for another set of instructions.)
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<usize> {
        let Tree { nodes, marked } = self.tree;
        let groups = nodes.len() / 2;
        while self.depth > 0 {
            self.depth -= 1;
            let node = self.stack[self.depth] as usize;
            let bounds = &nodes[node];
            let is_left_out = self.is_of_marks && !marked[node];
            if is_left_out || bounds.is_empty() || self.own.is_apart(bounds, self.reach) {
                continue;
            }
            if node >= groups {
                return Some(node - groups);
            }
            for child in [2 * node + 1, 2 * node] {
                let level = groups.ilog2() - child.ilog2();
                let last = ((child + 1) << level) - 1 - groups;
                if last >= self.first {
                    self.stack[self.depth] = child as u32;
                    self.depth += 1;
                }
            }
        }
        None
    }
}
