//! The blocks of the matrix that triangles of fabric add (NUMERICS §11, §12): general 3 x 3 blocks, A_ji = A_ij^T.

use std::cmp::Ordering;

use cloth_core::{Incidence, Model, Neighbours, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::Fabric;
use crate::memory::{FieldView, LANES, Lanes, VectorField};

/// A 3 x 3 block, row by row.
pub(crate) type Block<T> = [[T; 3]; 3];

/// A block of each particle of a packet.
type LaneBlock<T> = [[Lanes<T>; 3]; 3];

/// Rows in one task.
const ROWS: usize = 128;

/// There is no such place.
const NONE: u32 = u32::MAX;

/// Blocks off the diagonal of particles that triangles couple; diagonal blocks and right-hand sides of all particles.
///
/// Blocks with larger columns are summed up in compressed sparse rows. For products all rows are spread out, those of a packet of particles
/// side by side (sliced ELLPACK; Monakov, Lokhmotov and Avetisyan 2010), blocks with smaller columns as transposes, so that the matrix
/// is symmetric to the last bit.
#[derive(Debug)]
pub(crate) struct ElementBlocks<T> {
    neighbours: Neighbours,
    /// Where the blocks of each row with larger columns start, and the end.
    upper: Vec<u32>,
    blocks: Vec<Block<T>>,
    /// For each triangle of each particle where the blocks of its three particles go in the row, or [`NONE`].
    membrane_slots: Vec<[u32; 3]>,
    /// The same for the folds of each particle.
    fold_slots: Vec<[u32; 4]>,
    /// Where the entries of each packet start, and the end.
    slices: Vec<u32>,
    entries: Vec<Entry<T>>,
    /// For each entry the places among the blocks that are summed up, or [`NONE`].
    sources: Vec<Lanes<u32>>,
    /// xx, yy, zz, xy, xz, yz: minus the sum of the rest of each row, by which products stand for it.
    pub(crate) diagonal: Vec<[T; 6]>,
    pub(crate) right_side: Vec<[T; 3]>,
}

/// A block of each row of a packet. A row that has no more columns has itself, and zeros.
#[derive(Clone, Debug)]
struct Entry<T> {
    columns: Lanes<u32>,
    blocks: LaneBlock<T>,
}

/// What is added up for a row: the blocks with larger columns.
struct Row<'a, T> {
    blocks: &'a mut [PaddedBlock<T>],
    right_side: [T; 3],
}

impl<T: Real> ElementBlocks<T> {
    /// The pattern of a model, all numbers zero.
    pub(crate) fn new(model: &Model) -> Self {
        let interactions = model.interactions().of_fabric();
        let neighbours = Neighbours::new(&interactions);
        let count = neighbours.len();
        let mut upper = vec![0_u32; count + 1];
        for i in 0..count {
            let row = neighbours.row(i);
            upper[i + 1] = upper[i] + (row.len() - smaller(row, i)) as u32;
        }
        let source = |i: usize, j: usize| {
            let (row, column) = (i.min(j), i.max(j));
            let columns = neighbours.row(row);
            upper[row] + (smaller(columns, column) - smaller(columns, row)) as u32
        };
        let (mut slices, mut entries, mut sources) = (vec![0], Vec::new(), Vec::new());
        for first in (0..count).step_by(LANES) {
            let rows = first..(first + LANES).min(count);
            let longest = rows.clone().map(|i| neighbours.row(i).len()).max().unwrap_or(0);
            for slot in 0..longest {
                let mut entry = Entry {
                    columns: std::array::from_fn(|lane| (first + lane) as u32),
                    blocks: [[[T::ZERO; LANES]; 3]; 3],
                };
                let mut from = [NONE; LANES];
                for (lane, i) in rows.clone().enumerate() {
                    if let Some(&j) = neighbours.row(i).get(slot) {
                        entry.columns[lane] = j;
                        from[lane] = source(i, j as usize);
                    }
                }
                entries.push(entry);
                sources.push(from);
            }
            slices.push(entries.len() as u32);
        }
        let elements = model.elements();
        let corners: Vec<_> = elements.triangles().iter().map(|t| t.particles).collect();
        let folds: Vec<_> = elements.folds().iter().map(|fold| fold.particles).collect();
        Self {
            membrane_slots: slots(&neighbours, &Incidence::of(&corners, count), &corners),
            fold_slots: slots(&neighbours, &Incidence::of(&folds, count), &folds),
            blocks: vec![[[T::ZERO; 3]; 3]; upper[count] as usize],
            diagonal: vec![[T::ZERO; 6]; count],
            right_side: vec![[T::ZERO; 3]; count],
            neighbours,
            upper,
            slices,
            entries,
            sources,
        }
    }

    /// Sums up what the triangles have been linearised to, row by row, in the order of the triangles.
    pub(crate) fn assemble(&mut self, fabric: &Fabric<T>, arch: pulp::Arch) {
        let Self { upper, blocks, entries, slices, sources, diagonal, right_side, .. } = self;
        let slots = (&*self.membrane_slots, &*self.fold_slots);
        let mut rest = &mut **blocks;
        let tasks: Vec<_> = (upper[..upper.len() - 1].chunks(ROWS).enumerate())
            .map(|(number, starts)| {
                let first = number * ROWS;
                let length = upper[first + starts.len()] - starts[0];
                let (own, next) = std::mem::take(&mut rest).split_at_mut(length as usize);
                rest = next;
                (first, own)
            })
            .collect();
        (tasks.into_par_iter()).zip(right_side.par_chunks_mut(ROWS)).for_each(
            |((first, blocks), right_side)| {
                let out = (blocks, right_side);
                arch.dispatch(RowsTask { fabric, upper, slots, first, out });
            },
        );
        let mut rest = &mut **entries;
        let packets: Vec<_> = (slices.windows(2).enumerate())
            .map(|(packet, ends)| {
                let (own, next) =
                    std::mem::take(&mut rest).split_at_mut((ends[1] - ends[0]) as usize);
                rest = next;
                (packet * LANES, own, &sources[ends[0] as usize..])
            })
            .collect();
        let packets = packets.into_par_iter().zip(diagonal.par_chunks_mut(LANES));
        packets.with_min_len(ROWS / LANES).for_each(|((first, entries, sources), diagonal)| {
            let mut rest = [[T::ZERO; LANES]; 6];
            for (entry, sources) in entries.iter_mut().zip(sources) {
                entry.fill((blocks, sources), first);
                let [x, y, z] = &entry.blocks;
                let others = [&x[0], &y[1], &z[2], &x[1], &x[2], &y[2]];
                for (rest, other) in rest.iter_mut().zip(others) {
                    rest.iter_mut().zip(other).for_each(|(rest, other)| *rest -= *other);
                }
            }
            for (lane, diagonal) in diagonal.iter_mut().enumerate() {
                *diagonal = rest.each_ref().map(|rest| rest[lane]);
            }
        });
    }

    /// The rows of a packet of particles times a vector, columns ascending: each block takes the difference from the vector of its row, which stands
    /// for the diagonal block.
    #[inline(always)]
    pub(crate) fn packet_times(&self, packet: usize, vector: FieldView<'_, T>) -> [Lanes<T>; 3] {
        let mut sum = [[T::ZERO; LANES]; 3];
        let own = vector.packet((packet * LANES) as isize);
        let [first, end] = [self.slices[packet] as usize, self.slices[packet + 1] as usize];
        for Entry { columns, blocks, .. } in &self.entries[first..end] {
            let mut difference = vector.gather(columns);
            for (difference, own) in difference.iter_mut().zip(own) {
                for lane in 0..LANES {
                    difference[lane] -= own[lane];
                }
            }
            let [x, y, z] = &difference;
            for (sum, [to_x, to_y, to_z]) in sum.iter_mut().zip(blocks) {
                for lane in 0..LANES {
                    sum[lane] += to_x[lane] * x[lane] + to_y[lane] * y[lane] + to_z[lane] * z[lane];
                }
            }
        }
        sum
    }

    /// The blocks of a row, columns ascending.
    pub(crate) fn row(&self, i: usize, mut visit: impl FnMut(usize, Block<T>)) {
        let (first, lane) = (self.slices[i / LANES] as usize, i % LANES);
        for Entry { columns, blocks, .. } in
            &self.entries[first..first + self.neighbours.row(i).len()]
        {
            visit(columns[lane] as usize, blocks.map(|row| row.map(|column| column[lane])));
        }
    }

    /// Adds what the triangles add to the right-hand side.
    pub(crate) fn right_side_add(&self, right_side: &mut VectorField<T>) {
        for (i, change) in self.right_side.iter().enumerate() {
            let [x, y, z] = right_side.get(i);
            right_side.set(i, [x + change[0], y + change[1], z + change[2]]);
        }
    }
}

/// For each triangle of each particle where the blocks of its particles go in the row of that one, of which there are those with larger columns.
fn slots<const N: usize>(
    neighbours: &Neighbours,
    incidence: &Incidence,
    triangles: &[[u32; N]],
) -> Vec<[u32; N]> {
    let of_row = |i: usize| {
        let row = neighbours.row(i);
        let slot = move |j: u32| match (j as usize).cmp(&i) {
            Ordering::Less | Ordering::Equal => NONE,
            Ordering::Greater => (smaller(row, j as usize) - smaller(row, i)) as u32,
        };
        let triangles = incidence.row(i).iter().map(|&entry| triangles[entry as usize / N]);
        triangles.map(move |particles| particles.map(slot))
    };
    let rows = (0..neighbours.len()).into_par_iter().with_min_len(ROWS);
    rows.flat_map_iter(of_row).collect()
}

/// How many columns of a row are smaller.
fn smaller(columns: &[u32], than: usize) -> usize {
    columns.partition_point(|&j| (j as usize) < than)
}

impl<T: Real> Entry<T> {
    /// Copies blocks with larger columns, and transposes of those with smaller ones.
    fn fill(&mut self, (blocks, sources): (&[Block<T>], &Lanes<u32>), first: usize) {
        for lane in 0..LANES {
            let Some(block) = blocks.get(sources[lane] as usize) else { continue };
            let is_upper = self.columns[lane] as usize > first + lane;
            for (row, to) in self.blocks.iter_mut().enumerate() {
                for (column, to) in to.iter_mut().enumerate() {
                    to[lane] = if is_upper { block[row][column] } else { block[column][row] };
                }
            }
        }
    }
}

/// Where the blocks of triangles and of folds go.
type Slots<'a> = (&'a [[u32; 3]], &'a [[u32; 4]]);

/// A block whose rows fill vector registers; the fourth column is zero.
type PaddedBlock<T> = [[T; 4]; 3];

/// Blocks with larger columns and right-hand sides of some rows.
type RowsOut<'a, T> = (&'a mut [Block<T>], &'a mut [[T; 3]]);

/// Sums up some rows, compiled for each instruction set.
struct RowsTask<'a, T> {
    fabric: &'a Fabric<T>,
    upper: &'a [u32],
    slots: Slots<'a>,
    first: usize,
    out: RowsOut<'a, T>,
}

impl<T: Real> NullaryFnOnce for RowsTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { fabric, upper, slots, first, out: (mut blocks, right_side) } = self;
        let mut sums = Vec::new();
        for (local, right_side) in right_side.iter_mut().enumerate() {
            let i = first + local;
            let length = (upper[i + 1] - upper[i]) as usize;
            let (own, rest) = std::mem::take(&mut blocks).split_at_mut(length);
            blocks = rest;
            sums.clear();
            sums.resize(length, [[T::ZERO; 4]; 3]);
            let mut row = Row { blocks: &mut sums, right_side: [T::ZERO; 3] };
            fabric.membrane_row(i, slots.0, &mut row);
            fabric.fold_row(i, slots.1, &mut row);
            let bent = fabric.bending_force(i);
            *right_side = std::array::from_fn(|axis| row.right_side[axis] + bent[axis]);
            for (block, [x, y, z]) in own.iter_mut().zip(&sums) {
                *block = [[x[0], x[1], x[2]], [y[0], y[1], y[2]], [z[0], z[1], z[2]]];
            }
        }
    }
}

impl<T: Real> Row<'_, T> {
    #[inline(always)]
    fn push(&mut self, impulse: [T; 3]) {
        for axis in 0..3 {
            self.right_side[axis] += impulse[axis];
        }
    }
}

impl<T: Real> Fabric<T> {
    #[inline(always)]
    fn membrane_row(&self, i: usize, slots: &[[u32; 3]], row: &mut Row<'_, T>) {
        let first = self.around.offsets()[i] as usize;
        for (&entry, slots) in self.around.row(i).iter().zip(&slots[first..]) {
            let (triangle, a) = (entry as usize / 3, entry as usize % 3);
            let tangent = &self.membrane_tangents[triangle];
            row.push(tangent.impulses[a]);
            for (b, &slot) in slots.iter().enumerate().filter(|&(_, &slot)| slot != NONE) {
                let block = tangent.tangent.block(a, b);
                let to = &mut row.blocks[slot as usize];
                for (to, from) in to.iter_mut().zip(&block) {
                    for column in 0..3 {
                        to[column] += from[column];
                    }
                }
            }
        }
    }

    /// The blocks of two vertices of a fold: the product of a vector of one and one of the other. All blocks together are symmetric to the last bit, and
    /// positive semi-definite.
    #[inline(always)]
    fn fold_row(&self, i: usize, slots: &[[u32; 4]], row: &mut Row<'_, T>) {
        let around = &self.folds.around;
        let first = around.offsets()[i] as usize;
        for (&entry, slots) in around.row(i).iter().zip(&slots[first..]) {
            let tangent = self.folds.tangent(entry as usize / 4);
            let own = tangent[entry as usize % 4];
            for (other, &slot) in tangent.iter().zip(slots).filter(|&(_, &slot)| slot != NONE) {
                // A copy, of which the compiler knows that it does not overlap.
                let mut sum = row.blocks[slot as usize];
                for axis in 0..3 {
                    for column in 0..4 {
                        sum[axis][column] += other[column] * own[axis];
                    }
                }
                row.blocks[slot as usize] = sum;
            }
        }
    }
}
