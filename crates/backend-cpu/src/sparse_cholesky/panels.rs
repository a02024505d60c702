//! The numbers of a factorisation in the form that solves read.

use std::collections::HashMap;

use cloth_core::Real;
use faer::{
    Accum, MatMut, MatRef, Par,
    linalg::{
        matmul::triangular::{BlockStructure, matmul},
        triangular_inverse::invert_lower_triangular,
    },
};
use rayon::prelude::*;

use super::{
    TILE,
    factorisation::{SparseCholesky, Supernode},
    tree::{Node, Tree},
};

/// Panels of all supernodes, each cut into tiles of rows, and once more into tiles of columns.
///
/// A panel depends on the part of the matrix in the subtree of its supernode alone. Where such parts
/// are equal, as all over the inside of a regular patch, they have one panel in common: what a solve
/// reads is then a fraction of the factor.
#[derive(Debug, Default)]
pub(crate) struct Panels<T> {
    values: Vec<T>,
    /// Where the panel of each node starts.
    starts: Vec<usize>,
}

impl<T: Real> Panels<T> {
    /// Takes the numbers of the matrix `matrix`, factorised last.
    pub(super) fn fill(&mut self, tree: &Tree, matrix: &[f64], factorisation: &SparseCholesky) {
        let classes = classes(tree, matrix);
        let supernodes: Vec<_> = factorisation.supernodes().collect();
        let length = |node: &Node| node.panel_length() + node.panel_transposed_length();
        self.starts.clear();
        let mut end = 0;
        for (number, node) in tree.nodes.iter().enumerate() {
            let first = classes[number];
            self.starts.push(if first == number { end } else { self.starts[first] });
            if first == number {
                end += length(node);
            }
        }
        self.values.resize(end, T::ZERO);
        let mut rest = &mut *self.values;
        let mut parts = Vec::new();
        for (_, node) in tree.nodes.iter().enumerate().filter(|&(n, _)| classes[n] == n) {
            let (part, next) = rest.split_at_mut(length(node));
            parts.push((node, supernodes[node.number], part));
            rest = next;
        }
        parts.into_par_iter().for_each_init(Vec::new, |scratch, (node, supernode, part)| {
            let (panel, transposed) = part.split_at_mut(node.panel_length());
            fill_tiles(dense_panel(&supernode, scratch), panel, transposed);
        });
    }

    /// Tiles of rows and tiles of columns of a node.
    #[inline(always)]
    pub(super) fn of(&self, tree: &Tree, number: usize) -> [&[T]; 2] {
        let node = &tree.nodes[number];
        let (panel, rest) = self.values[self.starts[number]..].split_at(node.panel_length());
        [panel, &rest[..node.panel_transposed_length()]]
    }
}

/// For each node the first one with the same panel: one with the same rows and entries, and with
/// children that have the same panels and pass them on to the same rows.
fn classes(tree: &Tree, matrix: &[f64]) -> Vec<usize> {
    let mut first_with: HashMap<Vec<u64>, usize> = HashMap::new();
    let mut classes: Vec<usize> = Vec::with_capacity(tree.nodes.len());
    for (number, node) in tree.nodes.iter().enumerate() {
        let mut key = vec![node.columns() as u64, node.below as u64, node.children.len() as u64];
        for &child in &node.children {
            key.push(classes[child] as u64);
            key.extend(tree.nodes[child].rows_in_parent.iter().map(|&row| u64::from(row)));
        }
        for &[place, entry] in &node.entries {
            key.extend([u64::from(place), matrix[entry as usize].to_bits()]);
        }
        classes.push(*first_with.entry(key).or_insert(number));
    }
    classes
}

/// P of a supernode in double precision, column by column; zero above the diagonal.
fn dense_panel<'s>(
    &Supernode { columns, rows, values, .. }: &Supernode<'_>,
    scratch: &'s mut Vec<f64>,
) -> MatRef<'s, f64> {
    let height = columns + rows.len();
    scratch.clear();
    scratch.resize(height * columns, 0.0);
    let factor = MatRef::from_column_major_slice(values, height, columns);
    let (triangle, below) = factor.split_at_row(columns);
    let panel = MatMut::from_column_major_slice_mut(scratch, height, columns);
    let (mut inverse, mut product) = panel.split_at_row_mut(columns);
    invert_lower_triangular(inverse.as_mut(), triangle, Par::Seq);
    matmul(
        product.as_mut(),
        BlockStructure::Rectangular,
        Accum::Replace,
        below,
        BlockStructure::Rectangular,
        inverse.as_ref(),
        BlockStructure::TriangularLower,
        -1.0,
        Par::Seq,
    );
    MatRef::from_column_major_slice(scratch, height, columns)
}

/// Cuts P into tiles of rows, and into tiles of columns.
fn fill_tiles<T: Real>(dense: MatRef<'_, f64>, panel: &mut [T], transposed: &mut [T]) {
    let (rows, columns) = (dense.nrows(), dense.ncols());
    let entry = |row: usize, column: usize| {
        if row < rows && column < columns && column <= row {
            T::from_f64(dense[(row, column)])
        } else {
            T::ZERO
        }
    };
    let mut values = panel.iter_mut();
    for first in (0..rows).step_by(TILE) {
        for column in 0..columns.min(first + TILE) {
            for (row, value) in (first..first + TILE).zip(&mut values) {
                *value = entry(row, column);
            }
        }
    }
    let mut values = transposed.iter_mut();
    for first in (0..columns).step_by(TILE) {
        for row in first..rows {
            for (column, value) in (first..first + TILE).zip(&mut values) {
                *value = entry(row, column);
            }
        }
    }
}
