//! The blocks of the matrix that triangles of fabric add (NUMERICS §11, §12): general 3 x 3 blocks, A_ji = A_ij^T.

use cloth_core::{InteractionKind, Model, Neighbours, Real, fabric::bending::PATCH};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::Fabric;
use crate::memory::{FieldView, VectorField};

/// A 3 x 3 block, row by row.
pub(crate) type Block<T> = [[T; 3]; 3];

/// The columns of a 3 x 3 block, each in the lanes of a vector register, of which the last one is idle.
type Columns<T> = [[T; 4]; 3];

/// Rows in one task.
const TASK: usize = 64;

/// The place of a block that is on the diagonal.
const DIAGONAL: u16 = u16::MAX;

/// The place of a block that nobody has: of a vertex that is not there.
const NOWHERE: u16 = u16::MAX - 1;

/// Blocks off the diagonal of particles that triangles couple, in compressed sparse rows, A_ij and A_ji both, so that a product reads each
/// once and in order; diagonal blocks and right-hand sides of all particles.
#[derive(Debug)]
pub(crate) struct ElementBlocks<T> {
    neighbours: Neighbours,
    /// Where the blocks of each row start, and the end.
    starts: Vec<u32>,
    blocks: Vec<Columns<T>>,
    /// Where in its row each block of the triangles of a particle goes, triangles before patches, and where these start. Empty until the
    /// first assembly, and if a row is too long for such numbers.
    places: Vec<u16>,
    place_starts: Vec<u32>,
    /// Whether the blocks off the diagonal are of an earlier system.
    outdated: bool,
    /// xx, yy, zz, xy, xz, yz.
    pub(crate) diagonal: Vec<[T; 6]>,
    pub(crate) right_side: Vec<[T; 3]>,
}

impl<T: Real> ElementBlocks<T> {
    /// The pattern of a model, all numbers zero.
    pub(crate) fn new(model: &Model) -> Self {
        let mut interactions = model.interactions();
        interactions
            .retain(|kind| matches!(kind, InteractionKind::Membrane | InteractionKind::Bending));
        let neighbours = Neighbours::new(&interactions);
        let count = neighbours.len();
        let mut starts = vec![0_u32; count + 1];
        for i in 0..count {
            starts[i + 1] = starts[i] + neighbours.row(i).len() as u32;
        }
        Self {
            blocks: vec![[[T::ZERO; 4]; 3]; starts[count] as usize],
            diagonal: vec![[T::ZERO; 6]; count],
            right_side: vec![[T::ZERO; 3]; count],
            places: Vec::new(),
            place_starts: Vec::new(),
            outdated: true,
            neighbours,
            starts,
        }
    }

    /// Sums up diagonal blocks and right-hand sides of what the triangles have been linearised to, row by row, in the order of the
    /// triangles. The blocks off the diagonal follow when they are asked for.
    pub(crate) fn assemble(&mut self, fabric: &Fabric<T>) {
        let rows = self.diagonal.par_iter_mut().zip(&mut self.right_side).enumerate();
        rows.with_min_len(TASK).for_each(|(i, (diagonal, right_side))| {
            let mut block = [[T::ZERO; 3]; 3];
            *right_side = [T::ZERO; 3];
            let mut add = |own: Block<T>, impulse: [T; 3]| {
                add(block.as_flattened_mut(), own.as_flattened());
                add(right_side, &impulse);
            };
            for &entry in fabric.rows[0].row(i) {
                let (triangle, a) = (entry as usize / 3, entry as usize % 3);
                let tangent = &fabric.membrane_tangents[triangle];
                add(tangent.tangent.block(a, a), tangent.impulses[a]);
            }
            for &entry in fabric.rows[1].row(i) {
                let (patch, a) = (entry as usize / PATCH, entry as usize % PATCH);
                let tangent = &fabric.bending_tangents[patch];
                add(tangent.block(a, a), tangent.impulses[a]);
            }
            let d = block;
            *diagonal = [d[0][0], d[1][1], d[2][2], d[0][1], d[0][2], d[1][2]];
        });
        self.outdated = true;
    }

    /// Sums up the blocks off the diagonal of the last system, unless they are there.
    pub(crate) fn complete(&mut self, fabric: &Fabric<T>, arch: pulp::Arch) {
        if !std::mem::take(&mut self.outdated) {
            return;
        }
        if self.place_starts.is_empty() {
            self.places_find(fabric);
        }
        let Self { neighbours, starts, blocks, places, place_starts, .. } = self;
        let (neighbours, starts) = (&*neighbours, &**starts);
        let (places, place_starts) = (&**places, &**place_starts);
        let mut rest = &mut **blocks;
        let tasks: Vec<_> = (0..neighbours.len())
            .step_by(TASK)
            .map(|first| {
                let end = (first + TASK).min(neighbours.len());
                let length = (starts[end] - starts[first]) as usize;
                let (blocks, next) = std::mem::take(&mut rest).split_at_mut(length);
                rest = next;
                RowsTask {
                    fabric,
                    neighbours,
                    starts,
                    places,
                    place_starts,
                    rows: [first, end],
                    blocks,
                }
            })
            .collect();
        tasks.into_par_iter().for_each(|task| arch.dispatch(task));
    }

    fn places_find(&mut self, fabric: &Fabric<T>) {
        let Self { neighbours, places, place_starts, .. } = self;
        place_starts.push(0);
        let mut fits = true;
        for i in 0..neighbours.len() {
            let columns = neighbours.row(i);
            fits &= columns.len() < usize::from(NOWHERE);
            let triangles = fabric.rows[0].row(i).iter();
            let triangles =
                triangles.flat_map(|&entry| &fabric.membranes[entry as usize / 3].particles);
            let patches = fabric.rows[1].row(i).iter();
            let patches =
                patches.flat_map(|&entry| &fabric.patches[entry as usize / PATCH].particles);
            places.extend(triangles.chain(patches).map(|&j| place(columns, i, j)));
            place_starts.push(places.len() as u32);
        }
        if !fits {
            *places = Vec::new();
        }
    }

    /// The row of a particle times a vector, without the diagonal block, columns ascending.
    #[inline(always)]
    pub(crate) fn row_times(&self, i: usize, vector: FieldView<'_, T>) -> [T; 3] {
        let columns = self.neighbours.row(i);
        let blocks = &self.blocks[self.starts[i] as usize..][..columns.len()];
        let mut sum = [T::ZERO; 4];
        for (&j, [first, second, third]) in columns.iter().zip(blocks) {
            let [x, y, z] = vector.get(j as usize);
            for lane in 0..4 {
                sum[lane] += first[lane] * x + second[lane] * y + third[lane] * z;
            }
        }
        // The idle lane is computed, too: without it the compiler takes the other three apart.
        let [x, y, z, _] = std::hint::black_box(sum);
        [x, y, z]
    }

    /// The blocks of a row, columns ascending.
    pub(crate) fn row(&self, i: usize, mut visit: impl FnMut(usize, Block<T>)) {
        let columns = self.neighbours.row(i);
        let blocks = &self.blocks[self.starts[i] as usize..][..columns.len()];
        for (&j, block) in columns.iter().zip(blocks) {
            visit(j as usize, std::array::from_fn(|r| std::array::from_fn(|c| block[c][r])));
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

/// Where in a row the block of particle j goes.
fn place(columns: &[u32], i: usize, j: u32) -> u16 {
    if i == j as usize {
        return DIAGONAL;
    }
    // All that triangles couple is in the pattern.
    columns.binary_search(&j).map_or(NOWHERE, |place| place as u16)
}

#[inline(always)]
fn add<T: Real>(to: &mut [T], from: &[T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += *from;
    }
}

/// The blocks of some rows, compiled for each instruction set.
struct RowsTask<'a, 'b, T> {
    fabric: &'a Fabric<T>,
    neighbours: &'a Neighbours,
    starts: &'a [u32],
    places: &'a [u16],
    place_starts: &'a [u32],
    rows: [usize; 2],
    blocks: &'b mut [Columns<T>],
}

impl<T: Real> NullaryFnOnce for RowsTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { fabric, neighbours, starts, places, place_starts, rows: [first, end], blocks } =
            self;
        let base = starts[first];
        for i in first..end {
            let blocks = &mut blocks[(starts[i] - base) as usize..(starts[i + 1] - base) as usize];
            blocks.fill([[T::ZERO; 4]; 3]);
            let columns = neighbours.row(i);
            let places = match places.is_empty() {
                true => places,
                false => &places[place_starts[i] as usize..place_starts[i + 1] as usize],
            };
            let mut next = 0;
            let mut find = |j: u32| {
                let found = match places.get(next) {
                    Some(&NOWHERE | &DIAGONAL) => None,
                    Some(&place) => Some(usize::from(place)),
                    None => columns.binary_search(&j).ok(),
                };
                next += 1;
                found
            };
            for &entry in fabric.rows[0].row(i) {
                let (triangle, a) = (entry as usize / 3, entry as usize % 3);
                let tangent = &fabric.membrane_tangents[triangle].tangent;
                for (b, &j) in fabric.membranes[triangle].particles.iter().enumerate() {
                    let Some(place) = find(j) else { continue };
                    let upper = j as usize > i;
                    let block = if upper { tangent.block(a, b) } else { tangent.block(b, a) };
                    for column in 0..3 {
                        for row in 0..3 {
                            let entry = if upper { block[row][column] } else { block[column][row] };
                            blocks[place][column][row] += entry;
                        }
                    }
                }
            }
            for &entry in fabric.rows[1].row(i) {
                let (patch, a) = (entry as usize / PATCH, entry as usize % PATCH);
                let [gradients, moments] = fabric.bending_tangents[patch].factors();
                let own = |of: &[[[T; 3]; PATCH]; 3]| -> [[T; 4]; 3] {
                    std::array::from_fn(|k| [of[k][a][0], of[k][a][1], of[k][a][2], T::ZERO])
                };
                let (own_gradients, own_moments) = (own(gradients), own(moments));
                for (b, &j) in fabric.patches[patch].particles.iter().enumerate() {
                    let Some(place) = find(j) else { continue };
                    // The same products for A_ij and A_ji.
                    let (own, other) = if j as usize > i {
                        (&own_gradients, moments)
                    } else {
                        (&own_moments, gradients)
                    };
                    let to = &mut blocks[place];
                    for (column, to) in to.iter_mut().enumerate() {
                        let mut sum = [T::ZERO; 4];
                        for k in 0..3 {
                            let entry = other[k][b][column];
                            for lane in 0..4 {
                                sum[lane] += entry * own[k][lane];
                            }
                        }
                        for lane in 0..4 {
                            to[lane] += sum[lane];
                        }
                    }
                }
            }
        }
    }
}
