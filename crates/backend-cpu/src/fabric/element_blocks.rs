//! The blocks of the matrix that triangles of fabric add (NUMERICS §11, §12): general 3 x 3 blocks, A_ji = A_ij^T.

use cloth_core::{InteractionKind, Model, Neighbours, Real, fabric::bending::PATCH};
use rayon::prelude::*;

use super::Fabric;
use crate::memory::{FieldView, VectorField};

/// A 3 x 3 block, row by row.
pub(crate) type Block<T> = [[T; 3]; 3];

/// Blocks off the diagonal of particles that triangles couple, each once, in compressed sparse rows; diagonal blocks and right-hand
/// sides of all particles.
#[derive(Debug)]
pub(crate) struct ElementBlocks<T> {
    neighbours: Neighbours,
    /// Where the blocks of each row with larger columns start, and the end.
    upper: Vec<u32>,
    blocks: Vec<Block<T>>,
    /// For each neighbour of each particle the place of the block, in the order of the rows.
    places: Vec<u32>,
    /// Where the neighbours of each particle start.
    starts: Vec<u32>,
    /// xx, yy, zz, xy, xz, yz.
    pub(crate) diagonal: Vec<[T; 6]>,
    pub(crate) right_side: Vec<[T; 3]>,
}

/// What is added up for a row.
struct Row<'a, T> {
    columns: &'a [u32],
    blocks: &'a mut [Block<T>],
    diagonal: Block<T>,
    right_side: [T; 3],
}

impl<T: Real> ElementBlocks<T> {
    /// The pattern of a model, all numbers zero.
    pub(crate) fn new(model: &Model) -> Self {
        let mut interactions = model.interactions();
        interactions
            .retain(|kind| matches!(kind, InteractionKind::Membrane | InteractionKind::Bending));
        let neighbours = Neighbours::new(&interactions);
        let count = neighbours.len();
        let (mut upper, mut starts) = (vec![0_u32; count + 1], vec![0_u32; count + 1]);
        for i in 0..count {
            let row = neighbours.row(i);
            let later = row.len() - row.partition_point(|&j| (j as usize) < i);
            upper[i + 1] = upper[i] + later as u32;
            starts[i + 1] = starts[i] + row.len() as u32;
        }
        let mut next = upper.clone();
        let mut places = Vec::with_capacity(starts[count] as usize);
        for i in 0..count {
            for &j in neighbours.row(i) {
                // Rows are visited in order: those of row j with larger columns are taken one after the other.
                let slot = &mut next[i.min(j as usize)];
                places.push(if (j as usize) > i {
                    let first = upper[i];
                    let larger = places.len() as u32 - starts[i];
                    let smaller = neighbours.row(i).partition_point(|&j| (j as usize) < i) as u32;
                    first + larger - smaller
                } else {
                    let place = *slot;
                    *slot += 1;
                    place
                });
            }
        }
        Self {
            blocks: vec![[[T::ZERO; 3]; 3]; upper[count] as usize],
            diagonal: vec![[T::ZERO; 6]; count],
            right_side: vec![[T::ZERO; 3]; count],
            neighbours,
            upper,
            places,
            starts,
        }
    }

    /// Sums up what the triangles have been linearised to, row by row, in the order of the triangles.
    pub(crate) fn assemble(&mut self, fabric: &Fabric<T>) {
        let Self { neighbours, upper, blocks, diagonal, right_side, .. } = self;
        let mut rest = &mut **blocks;
        let rows: Vec<_> = (upper.windows(2).enumerate())
            .map(|(i, ends)| {
                let (own, next) =
                    std::mem::take(&mut rest).split_at_mut((ends[1] - ends[0]) as usize);
                rest = next;
                (i, own)
            })
            .collect();
        rows.into_par_iter().zip(diagonal).zip(right_side).with_min_len(64).for_each(
            |(((i, blocks), diagonal), right_side)| {
                let columns = neighbours.row(i);
                let columns = &columns[columns.len() - blocks.len()..];
                let zero = [[T::ZERO; 3]; 3];
                blocks.fill(zero);
                let mut row = Row { columns, blocks, diagonal: zero, right_side: zero[0] };
                fabric.membrane_row(i, &mut row);
                fabric.bending_row(i, &mut row);
                let d = row.diagonal;
                *diagonal = [d[0][0], d[1][1], d[2][2], d[0][1], d[0][2], d[1][2]];
                *right_side = row.right_side;
            },
        );
    }

    /// The row of a particle times a vector, without the diagonal block, columns ascending.
    #[inline(always)]
    pub(crate) fn row_times(&self, i: usize, vector: FieldView<'_, T>) -> [T; 3] {
        let mut sum = [T::ZERO; 3];
        self.for_each(i, |j, block, transposed| {
            let x = vector.get(j);
            for (row, sum) in sum.iter_mut().enumerate() {
                let entry = |k: usize| if transposed { block[k][row] } else { block[row][k] };
                *sum += entry(0) * x[0] + entry(1) * x[1] + entry(2) * x[2];
            }
        });
        sum
    }

    /// The blocks of a row, columns ascending.
    pub(crate) fn row(&self, i: usize, mut visit: impl FnMut(usize, Block<T>)) {
        self.for_each(i, |j, block, transposed| {
            let block = *block;
            let turned = || std::array::from_fn(|r| std::array::from_fn(|c| block[c][r]));
            visit(j, if transposed { turned() } else { block });
        });
    }

    #[inline(always)]
    fn for_each(&self, i: usize, mut visit: impl FnMut(usize, &Block<T>, bool)) {
        let start = self.starts[i] as usize;
        let columns = self.neighbours.row(i);
        let places = &self.places[start..start + columns.len()];
        for (&j, &place) in columns.iter().zip(places) {
            visit(j as usize, &self.blocks[place as usize], (j as usize) < i);
        }
    }

    /// Adds the diagonal blocks to a field of them.
    pub(crate) fn diagonal_add(&self, add: &mut impl FnMut(usize, [T; 6])) {
        self.diagonal.iter().enumerate().for_each(|(i, &block)| add(i, block));
    }

    /// Adds what the triangles add to the right-hand side.
    pub(crate) fn right_side_add(&self, right_side: &mut VectorField<T>) {
        for (i, change) in self.right_side.iter().enumerate() {
            let [x, y, z] = right_side.get(i);
            right_side.set(i, [x + change[0], y + change[1], z + change[2]]);
        }
    }
}

impl<T: Real> Row<'_, T> {
    /// Adds the block of this row and the row of particle `j`.
    #[inline(always)]
    fn add(&mut self, i: u32, j: u32, block: Block<T>) {
        let to = if i == j {
            &mut self.diagonal
        } else if j < i {
            return;
        } else {
            // All that triangles couple is in the pattern.
            let Ok(place) = self.columns.binary_search(&j) else { return };
            &mut self.blocks[place]
        };
        for (to, from) in to.iter_mut().flatten().zip(block.iter().flatten()) {
            *to += *from;
        }
    }

    #[inline(always)]
    fn push(&mut self, impulse: [T; 3]) {
        for (sum, entry) in self.right_side.iter_mut().zip(impulse) {
            *sum += entry;
        }
    }
}

impl<T: Real> Fabric<T> {
    fn membrane_row(&self, i: usize, row: &mut Row<'_, T>) {
        for &entry in self.rows[0].row(i) {
            let (triangle, a) = (entry as usize / 3, entry as usize % 3);
            let tangent = &self.membrane_tangents[triangle];
            row.push(tangent.impulses[a]);
            for (b, &j) in self.membranes[triangle].particles.iter().enumerate() {
                if j as usize >= i {
                    row.add(i as u32, j, tangent.tangent.block(a, b));
                }
            }
        }
    }

    fn bending_row(&self, i: usize, row: &mut Row<'_, T>) {
        for &entry in self.rows[1].row(i) {
            let (patch, a) = (entry as usize / PATCH, entry as usize % PATCH);
            let tangent = &self.bending_tangents[patch];
            row.push(tangent.impulses[a]);
            for (b, &j) in self.patches[patch].particles.iter().enumerate() {
                if j as usize >= i {
                    row.add(i as u32, j, tangent.block(a, b));
                }
            }
        }
    }
}
