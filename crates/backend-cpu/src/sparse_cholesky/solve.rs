//! Triangular solves for three right-hand sides, one for each axis.
//!
//! A supernode has a front: its columns, and the rows below. With L11 its triangle and L21 what is
//! below, its panel is
//!
//! ```text
//! P = [ L11^-1; -L21 L11^-1 ]
//! ```
//!
//! so that each half of a solve is one product with a dense matrix:
//!
//! ```text
//! [z; u] = P b            forward: b of its columns, u what the rows below receive
//! x = P^T [z; x_below]    backward
//! ```
//!
//! For a matrix with positive diagonal and no other positive entries, such as that of springs, L has
//! the same signs, P has no negative entry, and the products lose nothing to cancellation.

use std::ops::Range;

use cloth_core::{Error, Real, Result};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    TILE,
    factorisation::SparseCholesky,
    panels::Panels,
    tile::tile_product,
    tree::{Node, Tree},
};
use crate::memory::{BLOCK, VectorField};

/// The order of a triangular solve, and memory for it.
#[derive(Debug)]
pub(crate) struct SupernodalSolver<T> {
    tree: Tree,
    /// Fronts of all nodes, three components each.
    fronts: Vec<T>,
    /// Where each particle is in its front, and the length of a component there.
    places: Vec<[u32; 2]>,
}

impl<T: Real> SupernodalSolver<T> {
    /// # Errors
    /// `LimitExceeded` for a factor too large to be indexed.
    pub(crate) fn new(factorisation: &SparseCholesky) -> Result<Self> {
        let tree = Tree::new(factorisation);
        // Indices within fronts and panels are kept in 32 bits.
        let largest = tree.nodes.iter().map(|node| node.columns() * node.rows()).max();
        let largest = largest.unwrap_or(0).max(tree.fronts_length);
        if u32::try_from(largest).is_err() {
            return Err(Error::LimitExceeded {
                limit: "size of the factorised matrix",
                requested: largest as u64,
                max: u64::from(u32::MAX),
            });
        }
        let mut places = vec![[0; 2]; factorisation.pattern().len()];
        for node in &tree.nodes {
            for (column, &particle) in node.particles.iter().enumerate() {
                places[particle as usize] =
                    [(node.front + column) as u32, node.front_length() as u32];
            }
        }
        Ok(Self { fronts: vec![T::ZERO; tree.fronts_length], tree, places })
    }

    /// Makes the panels of the matrix `matrix`, factorised last.
    pub(crate) fn fill(
        &self,
        panels: &mut Panels<T>,
        matrix: &[f64],
        factorisation: &SparseCholesky,
    ) {
        panels.fill(&self.tree, matrix, factorisation);
    }

    /// Solves A x = b for the three components of `right_side`.
    pub(crate) fn solve(
        &mut self,
        panels: &Panels<T>,
        right_side: &VectorField<T>,
        solution: &mut VectorField<T>,
        arch: pulp::Arch,
    ) {
        let margin = right_side.margin();
        let right_side = right_side.padded().map(|component| &component[margin..]);
        let pass = Pass { tree: &self.tree, panels, right_side, arch };
        pass.forward(&mut self.fronts);
        pass.backward(&mut self.fronts);
        let fronts = &*self.fronts;
        let places = self.places.par_chunks(BLOCK);
        solution.chunks_mut(BLOCK).zip(places).for_each(|([x, y, z], places)| {
            for (local, &[place, stride]) in places.iter().enumerate() {
                let [place, stride] = [place, stride].map(|index| index as usize);
                x[local] = fronts[place];
                y[local] = fronts[place + stride];
                z[local] = fronts[place + 2 * stride];
            }
        });
    }
}

/// Both halves of a solve.
#[derive(Clone, Copy)]
struct Pass<'a, T> {
    tree: &'a Tree,
    panels: &'a Panels<T>,
    right_side: [&'a [T]; 3],
    arch: pulp::Arch,
}

/// Fronts that lie together in memory, from the place `start` on.
#[derive(Clone, Copy)]
struct Fronts<'a, T> {
    values: &'a [T],
    start: usize,
}

impl<T> Fronts<'_, T> {
    /// The front of a node, by components.
    #[inline(always)]
    fn of(&self, node: &Node) -> [&[T]; 3] {
        let length = node.front_length();
        let front = &self.values[node.front - self.start..][..3 * length];
        let (x, rest) = front.split_at(length);
        let (y, z) = rest.split_at(length);
        [x, y, z]
    }
}

impl<T: Real> Pass<'_, T> {
    fn forward(&self, fronts: &mut [T]) {
        let tree = self.tree;
        let first = |task: usize| tree.tasks.get(task).map_or(tree.tasks_end(), |task| task.start);
        self.each(0..tree.tasks.len(), &first, (fronts, 0), &|nodes, values, start| {
            self.arch.dispatch(ForwardRun { pass: self, nodes, values, start, before: None });
        });
        for level in &tree.levels {
            let (before, level_fronts) = fronts.split_at_mut(tree.nodes[level.start].front);
            let before = Fronts { values: before, start: 0 };
            let start = before.values.len();
            self.each(
                level.clone(),
                &|node| node,
                (level_fronts, start),
                &|nodes, values, start| {
                    let before = Some(before);
                    self.arch.dispatch(ForwardRun { pass: self, nodes, values, start, before });
                },
            );
        }
    }

    fn backward(&self, fronts: &mut [T]) {
        let tree = self.tree;
        for level in tree.levels.iter().rev() {
            let (fronts, after) = fronts.split_at_mut(self.front_of(level.end));
            let after = Fronts { values: after, start: fronts.len() };
            let start = tree.nodes[level.start].front;
            let level_fronts = &mut fronts[start..];
            self.each(
                level.clone(),
                &|node| node,
                (level_fronts, start),
                &|nodes, values, start| {
                    self.arch.dispatch(BackwardRun { pass: self, nodes, values, start, after });
                },
            );
        }
        let (fronts, after) = fronts.split_at_mut(self.front_of(tree.tasks_end()));
        let after = Fronts { values: after, start: fronts.len() };
        let first = |task: usize| tree.tasks.get(task).map_or(tree.tasks_end(), |task| task.start);
        self.each(0..tree.tasks.len(), &first, (fronts, 0), &|nodes, values, start| {
            self.arch.dispatch(BackwardRun { pass: self, nodes, values, start, after });
        });
    }

    /// Runs `work` on all items at once, with the nodes of each and their fronts, which begin at the
    /// given place. Item k has the nodes from `first(k)` to `first(k + 1)`.
    fn each(
        &self,
        items: Range<usize>,
        first: &(impl Fn(usize) -> usize + Sync),
        (fronts, start): (&mut [T], usize),
        work: &(impl Fn(Range<usize>, &mut [T], usize) + Sync),
    ) {
        if items.len() <= 1 {
            if !items.is_empty() {
                work(first(items.start)..first(items.end), fronts, start);
            }
            return;
        }
        let middle = items.start + items.len() / 2;
        let place = self.front_of(first(middle));
        let (left, right) = fronts.split_at_mut(place - start);
        rayon::join(
            || self.each(items.start..middle, first, (left, start), work),
            || self.each(middle..items.end, first, (right, place), work),
        );
    }

    /// Where the front of a node begins; the end of all for the number after the last.
    fn front_of(&self, node: usize) -> usize {
        self.tree.nodes.get(node).map_or(self.tree.fronts_length, |node| node.front)
    }

    /// Forward half of a node; its children are in `before`.
    #[inline(always)]
    fn forward_node(&self, number: usize, before: Fronts<'_, T>, front: [&mut [T]; 3]) {
        let node = &self.tree.nodes[number];
        let columns = node.columns();
        for axis in 0..3 {
            front[axis][columns..].fill(T::ZERO);
            for (value, &particle) in front[axis].iter_mut().zip(&node.particles) {
                *value = self.right_side[axis][particle as usize];
            }
        }
        for &child in &node.children {
            let child = &self.tree.nodes[child];
            let received = before.of(child);
            for axis in 0..3 {
                let received = &received[axis][child.columns()..];
                for (&row, &value) in child.rows_in_parent.iter().zip(received) {
                    front[axis][row as usize] += value;
                }
            }
        }
        // From the last tile to the first, as a tile overwrites what only those after it read.
        let [panel, _] = self.panels.of(self.tree, number);
        let mut end = panel.len();
        for first in (0..node.rows()).step_by(TILE).rev() {
            let width = columns.min(first + TILE);
            let tile = &panel[end - TILE * width..end];
            end -= TILE * width;
            let sums = tile_product(tile, front.each_ref().map(|component| &component[..width]));
            let own = columns.saturating_sub(first).min(TILE);
            for axis in 0..3 {
                let rows = &mut front[axis][first..first + TILE];
                rows[..own].copy_from_slice(&sums[axis][..own]);
                for row in own..TILE {
                    rows[row] += sums[axis][row];
                }
            }
        }
    }

    /// Backward half of a node; its parent is in `after`.
    #[inline(always)]
    fn backward_node(&self, number: usize, after: Fronts<'_, T>, front: [&mut [T]; 3]) {
        let node = &self.tree.nodes[number];
        let columns = node.columns();
        if let Some(parent) = node.parent {
            let parent = after.of(&self.tree.nodes[parent]);
            for axis in 0..3 {
                let below = &mut front[axis][columns..];
                for (value, &row) in below.iter_mut().zip(&node.rows_in_parent) {
                    *value = parent[axis][row as usize];
                }
            }
        }
        // From the first tile to the last, as a tile reads only rows from its own on.
        let [_, mut panel] = self.panels.of(self.tree, number);
        let rows = node.rows();
        for first in (0..columns).step_by(TILE) {
            let (tile, rest) = panel.split_at(TILE * (rows - first));
            panel = rest;
            let sums =
                tile_product(tile, front.each_ref().map(|component| &component[first..rows]));
            let own = (columns - first).min(TILE);
            for axis in 0..3 {
                front[axis][first..first + own].copy_from_slice(&sums[axis][..own]);
            }
        }
    }
}

/// The forward half of a run of nodes, compiled for each instruction set.
struct ForwardRun<'a, T> {
    pass: &'a Pass<'a, T>,
    nodes: Range<usize>,
    values: &'a mut [T],
    start: usize,
    /// Where the children are, if not within the run.
    before: Option<Fronts<'a, T>>,
}

impl<T: Real> NullaryFnOnce for ForwardRun<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for number in self.nodes {
            let node = &self.pass.tree.nodes[number];
            let (earlier, front) = self.values.split_at_mut(node.front - self.start);
            let before = self.before.unwrap_or(Fronts { values: earlier, start: self.start });
            self.pass.forward_node(number, before, components(front, node));
        }
    }
}

/// The backward half of a run of nodes, compiled for each instruction set.
struct BackwardRun<'a, T> {
    pass: &'a Pass<'a, T>,
    nodes: Range<usize>,
    values: &'a mut [T],
    start: usize,
    /// Where the parents are, if not within the run.
    after: Fronts<'a, T>,
}

impl<T: Real> NullaryFnOnce for BackwardRun<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for number in self.nodes.rev() {
            let node = &self.pass.tree.nodes[number];
            let place = node.front - self.start;
            let (front, later) = self.values[place..].split_at_mut(3 * node.front_length());
            let is_inside = node
                .parent
                .is_some_and(|parent| self.pass.tree.nodes[parent].front < self.after.start);
            let later = Fronts { values: later, start: self.start + place + front.len() };
            let after = if is_inside { later } else { self.after };
            self.pass.backward_node(number, after, components(front, node));
        }
    }
}

/// The front of a node at the start of `values`, by components.
#[inline(always)]
fn components<'a, T>(values: &'a mut [T], node: &Node) -> [&'a mut [T]; 3] {
    let length = node.front_length();
    let (x, rest) = values[..3 * length].split_at_mut(length);
    let (y, z) = rest.split_at_mut(length);
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse_cholesky::{
        LowerPattern, Neighbourhood, nested_dissection, pattern::tests::grid_springs,
    };

    const MARGIN: usize = 5;

    /// A matrix of masses and springs on a patch, and the order of elimination.
    fn system(side: u32) -> (LowerPattern, Vec<f64>, Vec<usize>) {
        let (positions, pairs) = grid_springs(side);
        let neighbourhood = Neighbourhood::new(positions.len(), &pairs);
        let order = nested_dissection(&positions, &neighbourhood, &neighbourhood.pieces());
        let order = order.into_iter().map(|particle| particle as usize).collect();
        let pattern = LowerPattern::of_particles(&neighbourhood);
        let mut values = vec![-0.5; pattern.rows.len()];
        for particle in 0..pattern.len() {
            values[pattern.offsets[particle]] =
                0.5 * neighbourhood.of(particle).len() as f64 + 1e-2 * (1 + particle % 3) as f64;
        }
        (pattern, values, order)
    }

    fn right_side<T: Real>(count: usize) -> VectorField<T> {
        let mut field = VectorField::new(count, MARGIN);
        for i in 0..count {
            let value =
                |k: usize| T::from_f64(((i * 7919 + k * 104_729) % 1000) as f64 / 500.0 - 1.0);
            field.set(i, [value(1), value(2), value(3)]);
        }
        field
    }

    fn solution<T: Real>(side: u32, threads: usize, arch: pulp::Arch) -> Vec<[f64; 3]> {
        let (pattern, values, order) = system(side);
        let count = pattern.len();
        let mut factorisation = SparseCholesky::new(pattern, Some(&order)).unwrap();
        factorisation.factorise(&values).unwrap();
        let mut solver = SupernodalSolver::<T>::new(&factorisation).unwrap();
        let mut panels = Panels::default();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut out = VectorField::new(count, MARGIN);
        pool.install(|| {
            solver.fill(&mut panels, &values, &factorisation);
            solver.solve(&panels, &right_side(count), &mut out, arch);
        });
        let mut read = Vec::new();
        out.read(&mut read);
        read
    }

    #[test]
    fn a_solve_is_that_of_faer() {
        for side in [1, 2, 7, 40, 90] {
            let (pattern, values, order) = system(side);
            let count = pattern.len();
            let mut factorisation = SparseCholesky::new(pattern, Some(&order)).unwrap();
            factorisation.factorise(&values).unwrap();
            let ours = solution::<f64>(side, 2, pulp::Arch::new());
            let single = solution::<f32>(side, 2, pulp::Arch::new());
            for axis in 0..3 {
                let mut theirs: Vec<f64> =
                    (0..count).map(|i| right_side::<f64>(count).get(i)[axis]).collect();
                factorisation.solve_in_place(&mut theirs);
                let largest = theirs.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
                for (i, expected) in theirs.iter().enumerate() {
                    assert!((ours[i][axis] - expected).abs() < 1e-12 * largest, "{side} {i}");
                    assert!((single[i][axis] - expected).abs() < 1e-4 * largest, "{side} {i}");
                }
            }
        }
    }

    #[test]
    fn threads_and_width_do_not_change_the_bits() {
        let expected = solution::<f32>(120, 1, pulp::Arch::new());
        for threads in [2, 8] {
            assert_eq!(solution::<f32>(120, threads, pulp::Arch::new()), expected);
        }
        assert_eq!(solution::<f32>(120, 2, pulp::Arch::Scalar), expected);
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let (pattern, mut values, order) = system(9);
        let mut factorisation = SparseCholesky::new(pattern, Some(&order)).unwrap();
        assert!(factorisation.factorise(&values).is_ok());
        for bad in [-1.0, 0.0, f64::INFINITY, f64::NAN] {
            let good = std::mem::replace(&mut values[0], bad);
            assert!(factorisation.factorise(&values).is_err(), "{bad}");
            values[0] = good;
        }
        assert!(factorisation.factorise(&values).is_ok());
    }
}
