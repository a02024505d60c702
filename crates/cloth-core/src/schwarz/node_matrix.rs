//! A symmetric matrix between groups: blocks of 6 x 6 in compressed sparse rows, both triangles, in double precision.

use std::collections::HashMap;

use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::rigid_modes::{Matrix6, product, transposed_product, transposed_product_add};

/// Rows in one task.
const TASK: usize = 32;

/// The matrix.
#[derive(Debug, Default)]
pub struct NodeMatrix {
    starts: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Matrix6>,
    /// The same blocks, column by column.
    turned: Vec<Matrix6>,
}

/// The blocks of a row on the diagonal and right of it, columns ascending.
pub(super) type UpperRow = Vec<(u32, Matrix6)>;

impl NodeMatrix {
    /// From rows of both triangles: where they start, columns, ascending in each row, and blocks.
    #[must_use]
    pub fn new(starts: Vec<u32>, columns: Vec<u32>, blocks: Vec<Matrix6>) -> Self {
        let turned = blocks.iter().map(turned).collect();
        Self { starts, columns, blocks, turned }
    }

    /// From the blocks on the diagonal and right of it.
    pub(super) fn from_upper(rows: &[UpperRow]) -> Self {
        let mut starts = vec![0_u32; rows.len() + 1];
        for (row, blocks) in rows.iter().enumerate() {
            starts[row + 1] += blocks.len() as u32;
            for &(column, _) in blocks.iter().filter(|&&(column, _)| column as usize != row) {
                starts[column as usize + 1] += 1;
            }
        }
        for row in 0..rows.len() {
            starts[row + 1] += starts[row];
        }
        let count = starts[rows.len()] as usize;
        let (mut columns, mut blocks) = (vec![0; count], vec![[[0.0; 6]; 6]; count]);
        let mut next = starts.clone();
        let mut put = |row: usize, column: u32, block: Matrix6| {
            let place = next[row] as usize;
            (columns[place], blocks[place]) = (column, block);
            next[row] += 1;
        };
        // A row gets its smaller columns before the others, all ascending.
        for (row, upper) in rows.iter().enumerate() {
            for &(column, block) in upper {
                put(row, column, block);
                if column as usize != row {
                    put(column as usize, row as u32, turned(&block));
                }
            }
        }
        Self::new(starts, columns, blocks)
    }

    /// Nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where the blocks of each row start, and the end.
    #[must_use]
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The columns of all blocks, ascending in each row.
    #[must_use]
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// All blocks.
    #[must_use]
    pub fn blocks(&self) -> &[Matrix6] {
        &self.blocks
    }

    /// All blocks, column by column.
    #[must_use]
    pub fn turned(&self) -> &[Matrix6] {
        &self.turned
    }

    /// Columns and blocks of a row.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (usize, &Matrix6)> {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        self.columns[range.clone()].iter().map(|&column| column as usize).zip(&self.blocks[range])
    }

    /// A row of A x.
    #[inline(always)]
    pub(super) fn row_product(&self, row: usize, x: &[f64]) -> [f64; 6] {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        let mut sum = [0.0; 6];
        for (&column, block) in self.columns[range.clone()].iter().zip(&self.turned[range]) {
            let x = &x[6 * column as usize..][..6];
            for (entries, x) in block.iter().zip(x) {
                (0..6).for_each(|k| sum[k] += entries[k] * x);
            }
        }
        sum
    }

    /// to = A x.
    pub(super) fn apply(&self, x: &[f64], to: &mut [f64], arch: pulp::Arch) {
        to.par_chunks_mut(6 * TASK).enumerate().for_each(|(task, to)| {
            arch.dispatch(Product { matrix: self, x, first: TASK * task, to });
        });
    }

    /// P^T A P for groups of consecutive nodes, which `starts` bounds and `group_of` names.
    pub(super) fn coarse(
        &self,
        prolongation: &[Matrix6],
        starts: &[u32],
        group_of: &[u32],
    ) -> Self {
        let rows: Vec<UpperRow> = (0..starts.len() - 1)
            .into_par_iter()
            .map(|group| {
                let mut row = RowSum::new(group as u32);
                for node in starts[group] as usize..starts[group + 1] as usize {
                    for (column, block) in self.row(node) {
                        if let Some(to) = row.block(group_of[column]) {
                            let image = product(block, &prolongation[column]);
                            transposed_product_add(to, &prolongation[node], &image);
                        }
                    }
                }
                row.finish()
            })
            .collect();
        Self::from_upper(&rows)
    }
}

/// A block, its columns as rows.
fn turned(block: &Matrix6) -> Matrix6 {
    std::array::from_fn(|row| std::array::from_fn(|column| block[column][row]))
}

/// A x on some nodes, compiled for each instruction set.
struct Product<'a, 'b> {
    matrix: &'a NodeMatrix,
    x: &'a [f64],
    first: usize,
    to: &'b mut [f64],
}

impl NullaryFnOnce for Product<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { matrix, x, first, to } = self;
        for (row, to) in (first..).zip(to.as_chunks_mut::<6>().0) {
            *to = matrix.row_product(row, x);
        }
    }
}

/// A row of a matrix between groups, while it is summed up.
#[derive(Debug)]
pub(super) struct RowSum {
    row: u32,
    blocks: UpperRow,
    last: usize,
    /// Places of the columns, once there are more than a search along them is good for.
    places: HashMap<u32, usize>,
}

/// Columns that are searched one after the other.
const SEARCHED: usize = 32;

impl RowSum {
    pub(super) fn new(row: u32) -> Self {
        Self { row, blocks: vec![(row, [[0.0; 6]; 6])], last: 0, places: HashMap::new() }
    }

    /// The block of a column, if it is on the diagonal or right of it.
    #[inline(always)]
    pub(super) fn block(&mut self, column: u32) -> Option<&mut Matrix6> {
        if column < self.row {
            return None;
        }
        if self.blocks[self.last].0 != column {
            self.last = self.place(column);
        }
        Some(&mut self.blocks[self.last].1)
    }

    fn place(&mut self, column: u32) -> usize {
        let found = if self.places.is_empty() {
            self.blocks.iter().position(|&(other, _)| other == column)
        } else {
            self.places.get(&column).copied()
        };
        found.unwrap_or_else(|| {
            self.blocks.push((column, [[0.0; 6]; 6]));
            let place = self.blocks.len() - 1;
            if place == SEARCHED {
                let all = self.blocks.iter().enumerate();
                self.places = all.map(|(place, &(column, _))| (column, place)).collect();
            } else if place > SEARCHED {
                self.places.insert(column, place);
            }
            place
        })
    }

    /// The row, columns ascending, its diagonal block as symmetric as it is but for rounding.
    pub(super) fn finish(mut self) -> UpperRow {
        let diagonal = &mut self.blocks[0].1;
        for row in 0..6 {
            for column in 0..row {
                let mean = 0.5 * (diagonal[row][column] + diagonal[column][row]);
                (diagonal[row][column], diagonal[column][row]) = (mean, mean);
            }
        }
        self.blocks.sort_unstable_by_key(|&(column, _)| column);
        self.blocks
    }
}

/// P^T a P for two blocks of P with three rows.
pub(super) fn congruent(p: &[[f64; 6]; 3], a: &[[f64; 3]; 3], q: &[[f64; 6]; 3]) -> Matrix6 {
    let mut image = [[0.0; 6]; 3];
    for (image, a) in image.iter_mut().zip(a) {
        for (a, q) in a.iter().zip(q) {
            for column in 0..6 {
                image[column] += a * q[column];
            }
        }
    }
    transposed_product(p, &image)
}
