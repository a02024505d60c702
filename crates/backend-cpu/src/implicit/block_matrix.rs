//! The matrix A as 3 x 3 blocks in symmetric sparse rows.

use cloth_core::{Real, Springs};
use rayon::prelude::*;

use super::matrix::{Matrix, Symmetric};
use crate::{
    memory::{BLOCK, FieldView, VectorField},
    springs::SpringColumns,
};

/// A as blocks: one for each particle, one for each spring in the order of
/// [`Springs::iter`](cloth_core::Springs::iter), and one for each pair in contact. All are
/// symmetric, with the signs they have in A.
#[derive(Clone, Debug)]
pub(crate) struct BlockMatrix<T> {
    /// The diagonal blocks.
    pub(super) diagonal: Vec<Symmetric<T>>,
    /// The blocks of springs, in the rows of their particles of smaller index.
    pub(super) blocks: Vec<Symmetric<T>>,
    /// Where the springs of each row start in `blocks`, length n + 1.
    offsets: Vec<u32>,
    /// The particle of larger index of each spring.
    columns: Vec<u32>,
    gather: Gather,
    pairs: Vec<Pair<T>>,
    /// Empty while there is no pair.
    pair_gather: Gather,
}

/// A pair in contact, the smaller index first, and its block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair<T> {
    pub(super) particles: [u32; 2],
    pub(super) block: Symmetric<T>,
}

/// For each particle its partners, ascending, and the places of the blocks.
#[derive(Clone, Debug, Default)]
struct Gather {
    offsets: Vec<u32>,
    entries: Vec<[u32; 2]>,
}

impl Gather {
    /// From pairs sorted by (i, j), i < j.
    fn fill(&mut self, count: usize, pairs: impl Iterator<Item = [u32; 2]> + Clone) {
        self.offsets.clear();
        self.offsets.resize(count + 2, 0);
        for [i, j] in pairs.clone() {
            self.offsets[i as usize + 2] += 1;
            self.offsets[j as usize + 2] += 1;
        }
        for particle in 0..count {
            self.offsets[particle + 2] += self.offsets[particle + 1];
        }
        self.entries.clear();
        self.entries.resize(self.offsets[count + 1] as usize, [0; 2]);
        // Rows receive their smaller partners first, ascending, then the larger ones.
        for (place, [i, j]) in pairs.enumerate() {
            for (row, partner) in [(i, j), (j, i)] {
                let slot = &mut self.offsets[row as usize + 1];
                self.entries[*slot as usize] = [partner, place as u32];
                *slot += 1;
            }
        }
        self.offsets.pop();
    }

    #[inline(always)]
    fn of(&self, particle: usize) -> &[[u32; 2]] {
        &self.entries[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }
}

impl<T: Real> BlockMatrix<T> {
    /// The structure of the springs, all numbers zero.
    pub(crate) fn of_springs(springs: &Springs, count: usize) -> Self {
        let pairs: Vec<_> = springs.iter().map(|spring| spring.particles).collect();
        Self::new(count, &pairs)
    }

    /// The structure of pairs sorted by (i, j), i < j, all numbers zero.
    pub(super) fn new(count: usize, pairs: &[[u32; 2]]) -> Self {
        let mut offsets = vec![0; count + 1];
        pairs.iter().for_each(|&[i, _]| offsets[i as usize + 1] += 1);
        for particle in 0..count {
            offsets[particle + 1] += offsets[particle];
        }
        let mut gather = Gather::default();
        gather.fill(count, pairs.iter().copied());
        Self {
            diagonal: vec![[T::ZERO; 6]; count],
            blocks: vec![[T::ZERO; 6]; pairs.len()],
            offsets,
            columns: pairs.iter().map(|&[_, j]| j).collect(),
            gather,
            pairs: Vec::new(),
            pair_gather: Gather::default(),
        }
    }

    /// Number of particles.
    pub(super) fn count(&self) -> usize {
        self.diagonal.len()
    }

    /// The larger particles and the blocks of the springs of a row.
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> (&[u32], &[Symmetric<T>]) {
        let range = self.offsets[i] as usize..self.offsets[i + 1] as usize;
        (&self.columns[range.clone()], &self.blocks[range])
    }

    /// The pairs in contact, sorted.
    pub(super) fn pairs(&self) -> &[Pair<T>] {
        &self.pairs
    }

    /// Springs and pairs of a particle with smaller partners: partner and block.
    pub(super) fn before(&self, i: usize) -> impl Iterator<Item = (usize, Symmetric<T>)> + '_ {
        let smaller = move |&&[partner, _]: &&[u32; 2]| (partner as usize) < i;
        let springs = self.gather.of(i).iter().take_while(smaller);
        let springs = springs.map(|&[j, place]| (j as usize, self.blocks[place as usize]));
        let pairs = if self.pairs.is_empty() { &[] } else { self.pair_gather.of(i) };
        let pairs = pairs.iter().take_while(smaller);
        springs.chain(pairs.map(|&[j, place]| (j as usize, self.pairs[place as usize].block)))
    }

    /// Takes the numbers of a matrix of the same springs, and its pairs in contact.
    pub(super) fn fill(&mut self, matrix: &Matrix<T>, springs: &SpringColumns<T>) {
        let count = self.count();
        let Self { diagonal, blocks, offsets, pairs, .. } = self;
        let mut rest = &mut **blocks;
        let mut parts = Vec::with_capacity(count.div_ceil(BLOCK));
        for (number, diagonal) in diagonal.chunks_mut(BLOCK).enumerate() {
            let first = number * BLOCK;
            let length = offsets[first + diagonal.len()] - offsets[first];
            let (part, next) = rest.split_at_mut(length as usize);
            parts.push((first, diagonal, part));
            rest = next;
        }
        let offsets = &*offsets;
        let contacts: Vec<Vec<Pair<T>>> = parts
            .into_par_iter()
            .map(|(first, diagonal, blocks)| {
                let mut contacts = Vec::new();
                let mut place = 0;
                for (i, diagonal) in (first..).zip(diagonal) {
                    *diagonal = matrix.diagonal.get(i);
                    let end = (offsets[i + 1] - offsets[first]) as usize;
                    // Springs come first, ascending; what is left are contacts.
                    matrix.row(springs, i, |j, block| {
                        if j <= i {
                            return;
                        }
                        if place < end {
                            blocks[place] = block;
                            place += 1;
                        } else {
                            contacts.push(Pair { particles: [i as u32, j as u32], block });
                        }
                    });
                }
                contacts
            })
            .collect();
        pairs.clear();
        pairs.extend(contacts.into_iter().flatten());
        self.pairs_link();
    }

    /// Sets the pairs in contact, sorted.
    #[cfg(test)]
    pub(super) fn set_pairs(&mut self, pairs: &[Pair<T>]) {
        self.pairs.clear();
        self.pairs.extend_from_slice(pairs);
        self.pairs_link();
    }

    fn pairs_link(&mut self) {
        if !self.pairs.is_empty() {
            let pairs = self.pairs.iter().map(|pair| pair.particles);
            self.pair_gather.fill(self.diagonal.len(), pairs);
        }
    }

    /// to = A from: the diagonal, then springs, then pairs, each ascending.
    pub(crate) fn apply(&self, from: &VectorField<T>, to: &mut VectorField<T>) {
        let from = FieldView::new(from);
        let count = self.count();
        to.chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
            for i in block * BLOCK..count.min((block + 1) * BLOCK) {
                let row = self.row_apply(i, from);
                for axis in 0..3 {
                    chunk[axis][i - block * BLOCK] = row[axis];
                }
            }
        });
    }

    #[inline(always)]
    fn row_apply(&self, i: usize, from: FieldView<'_, T>) -> [T; 3] {
        let mut sum = times(&self.diagonal[i], from.get(i));
        let mut add = |block: &Symmetric<T>, partner: u32| {
            let term = times(block, from.get(partner as usize));
            for axis in 0..3 {
                sum[axis] += term[axis];
            }
        };
        for &[partner, place] in self.gather.of(i) {
            add(&self.blocks[place as usize], partner);
        }
        if !self.pairs.is_empty() {
            for &[partner, place] in self.pair_gather.of(i) {
                add(&self.pairs[place as usize].block, partner);
            }
        }
        sum
    }
}

/// A symmetric matrix times a vector.
#[inline(always)]
pub(super) fn times<T: Real>(
    &[xx, yy, zz, xy, xz, yz]: &Symmetric<T>,
    [x, y, z]: [T; 3],
) -> [T; 3] {
    [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A small generator of numbers in \[-1, 1\], the same on every run.
    pub(in super::super) struct Numbers(u64);

    impl Numbers {
        pub(in super::super) const fn new(seed: u64) -> Self {
            Self(seed)
        }

        pub(in super::super) fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        pub(in super::super) fn index(&mut self, count: usize) -> usize {
            ((0.5 * self.next() + 0.5) * count as f64) as usize % count
        }

        pub(in super::super) fn vector(&mut self) -> [f64; 3] {
            [self.next(), self.next(), self.next()]
        }

        pub(in super::super) fn field<T: Real>(&mut self, count: usize) -> VectorField<T> {
            let mut field = VectorField::new(count, 3);
            for i in 0..count {
                field.set(i, self.vector().map(T::from_f64));
            }
            field
        }
    }

    /// Sorted random pairs, each once.
    pub(in super::super) fn random_pairs(
        count: usize,
        wanted: usize,
        numbers: &mut Numbers,
    ) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        while count > 1 && pairs.len() < wanted {
            let [a, b] = [numbers.index(count) as u32, numbers.index(count) as u32];
            if a != b {
                pairs.push([a.min(b), a.max(b)]);
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    /// Masses and springs g I + u u^T of random directions and strengths, and as many contacts.
    pub(in super::super) fn random_matrix<T: Real>(
        count: usize,
        springs: &[[u32; 2]],
        contacts: &[[u32; 2]],
        numbers: &mut Numbers,
    ) -> BlockMatrix<T> {
        let mut matrix = BlockMatrix::new(count, springs);
        for i in 0..count {
            let mass = T::from_f64(0.2 + 0.1 * numbers.next());
            matrix.diagonal[i] = [mass, mass, mass, T::ZERO, T::ZERO, T::ZERO];
        }
        let mut block = || {
            let [x, y, z] = numbers.vector();
            let g = numbers.next().max(0.0);
            [g + x * x, g + y * y, g + z * z, x * y, x * z, y * z].map(T::from_f64)
        };
        let spring_blocks: Vec<_> = springs.iter().map(|_| block()).collect();
        let contact_blocks: Vec<_> = contacts.iter().map(|_| block()).collect();
        let all = springs.iter().zip(&spring_blocks).chain(contacts.iter().zip(&contact_blocks));
        for (pair, block) in all {
            for &particle in pair {
                for entry in 0..6 {
                    matrix.diagonal[particle as usize][entry] += block[entry];
                }
            }
        }
        matrix.blocks = spring_blocks.iter().map(|block| block.map(|entry| -entry)).collect();
        let pairs: Vec<_> = contacts
            .iter()
            .zip(&contact_blocks)
            .map(|(&particles, block)| Pair { particles, block: block.map(|entry| -entry) })
            .collect();
        matrix.set_pairs(&pairs);
        matrix
    }

    /// The matrix with all its entries.
    pub(in super::super) fn dense<T: Real>(matrix: &BlockMatrix<T>) -> Vec<Vec<f64>> {
        let count = matrix.count();
        let mut dense = vec![vec![0.0; 3 * count]; 3 * count];
        let mut add = |i: usize, j: usize, block: &Symmetric<T>| {
            let rows = super::super::particle_filters::rows(block);
            for (row, values) in rows.iter().enumerate() {
                for (column, value) in values.iter().enumerate() {
                    dense[3 * i + row][3 * j + column] += value.to_f64();
                }
            }
        };
        for i in 0..count {
            add(i, i, &matrix.diagonal[i]);
            let (columns, blocks) = matrix.row(i);
            for (&j, block) in columns.iter().zip(blocks) {
                add(i, j as usize, block);
                add(j as usize, i, block);
            }
        }
        for pair in matrix.pairs() {
            let [i, j] = pair.particles.map(|particle| particle as usize);
            add(i, j, &pair.block);
            add(j, i, &pair.block);
        }
        dense
    }

    #[test]
    fn a_product_is_that_of_the_dense_matrix() {
        let mut numbers = Numbers::new(3);
        for count in [1, 2, 17, 90] {
            let springs = random_pairs(count, 4 * count, &mut numbers);
            for contacts in [Vec::new(), random_pairs(count, count, &mut numbers)] {
                let matrix = random_matrix::<f64>(count, &springs, &contacts, &mut numbers);
                let from = numbers.field(count);
                let mut to = VectorField::new(count, 0);
                matrix.apply(&from, &mut to);
                for (i, row) in dense(&matrix).iter().enumerate() {
                    let terms = row.iter().enumerate().map(|(j, a)| a * from.get(j / 3)[j % 3]);
                    let expected: f64 = terms.sum();
                    assert!((to.get(i / 3)[i % 3] - expected).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn smaller_partners_are_found_with_their_blocks() {
        let mut numbers = Numbers::new(4);
        let springs = [[0, 2], [0, 3], [1, 3], [2, 3]];
        let matrix = random_matrix::<f64>(4, &springs, &[[1, 3]], &mut numbers);
        let found: Vec<_> = matrix.before(3).collect();
        let [a, b, c] = [1, 2, 3].map(|place| matrix.blocks[place]);
        assert_eq!(found, [(0, a), (1, b), (2, c), (1, matrix.pairs()[0].block)]);
        assert_eq!(matrix.before(0).count(), 0);
    }
}
