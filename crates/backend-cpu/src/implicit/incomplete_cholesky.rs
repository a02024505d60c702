//! NUMERICS §5: incomplete Cholesky factorisation in blocks of 3 x 3 without fill, as a
//! preconditioner.
//!
//! Each part of the particles has a factorisation L D L^T of its own, L with unit diagonal and blocks
//! where A has them. Parts are worked on in parallel; rows within a part follow each other.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    block_matrix::{BlockMatrix, times},
    matrix::Symmetric,
    particle_filters::{ParticleFilters, rows},
    preconditioner::invert,
};
use crate::memory::{FieldView, VectorField};

/// Particles in a part.
const PART: usize = 2048;

/// A pivot counts as positive definite if what each elimination leaves of it is more than this share
/// of its trace: smaller ones would make a matrix with wild numbers.
const PIVOT_MIN: f64 = 1e-3;

/// Numbers of a block, column by column.
const SIZE: usize = 9;

/// The factorisation.
#[derive(Debug, Default)]
pub(crate) struct IncompleteCholesky<T> {
    parts: Vec<Part<T>>,
}

/// The factorisation of one part; indices count within it.
#[derive(Debug, Default)]
struct Part<T> {
    first: usize,
    /// L by rows, without the diagonal.
    lower: Rows<T>,
    /// L^T by rows, without the diagonal.
    upper: Rows<T>,
    /// For each block of `lower` its place in `upper`.
    mirror: Vec<u32>,
    /// D^-1
    inverse: Vec<Symmetric<T>>,
    /// L D by rows while it is factorised.
    scaled: Vec<T>,
    /// Place of each column in the row that is being eliminated.
    slots: Vec<u32>,
    /// A vector, with a fourth component so that it is loaded at once.
    vector: Vec<[T; 4]>,
}

/// Blocks in sparse rows.
#[derive(Debug, Default)]
struct Rows<T> {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    /// [`SIZE`] numbers for each block, and one more at the end, as columns are loaded as four.
    blocks: Vec<T>,
}

const NONE: u32 = u32::MAX;

impl<T: Real> IncompleteCholesky<T> {
    /// Factorises S A S + (I - S) less the blocks between parts.
    pub(crate) fn build(
        &mut self,
        matrix: &BlockMatrix<T>,
        filters: &ParticleFilters<T>,
        arch: pulp::Arch,
    ) {
        let count = matrix.count();
        self.parts.resize_with(count.div_ceil(PART), Part::default);
        self.parts.par_iter_mut().enumerate().for_each(|(number, part)| {
            part.first = number * PART;
            part.take(matrix, filters, PART.min(count - part.first));
            arch.dispatch(FactoriseTask { part, matrix, filters });
        });
    }

    /// to = P^-1 from.
    pub(crate) fn apply(
        &mut self,
        from: &VectorField<T>,
        to: &mut VectorField<T>,
        arch: pulp::Arch,
    ) {
        let from = FieldView::new(from);
        to.chunks_mut(PART).zip(&mut self.parts).for_each(|(to, part)| {
            arch.dispatch(ApplyTask { part, from, to });
        });
    }
}

impl<T: Real> Part<T> {
    /// Takes the pattern and the blocks off the diagonal of `count` rows.
    fn take(&mut self, matrix: &BlockMatrix<T>, filters: &ParticleFilters<T>, count: usize) {
        let first = self.first;
        self.lower.clear();
        self.slots.clear();
        self.slots.resize(count, NONE);
        for row in 0..count {
            let start = self.lower.columns.len();
            // A pair that a spring and contact join has one block.
            for (partner, block) in matrix.before(first + row).filter(|&(j, _)| j >= first) {
                let block = filters.block(first + row, partner, block);
                let known = &self.lower.columns[start..];
                let column = (partner - first) as u32;
                match known.iter().position(|&other| other == column) {
                    Some(place) => self.lower.add(start + place, &block),
                    None => self.lower.push(column, &block),
                }
            }
            self.lower.row_end(start);
        }
        self.lower.blocks.push(T::ZERO);
        self.transpose(count);
        self.inverse.resize(count, [T::ZERO; 6]);
        self.scaled.clear();
        self.scaled.resize(self.lower.blocks.len(), T::ZERO);
        self.vector.resize(count, [T::ZERO; 4]);
    }

    /// Makes the pattern of L^T.
    fn transpose(&mut self, count: usize) {
        let Rows { offsets, columns, blocks } = &mut self.upper;
        offsets.clear();
        offsets.resize(count + 1, 0);
        for &column in &self.lower.columns {
            offsets[column as usize + 1] += 1;
        }
        for row in 0..count {
            offsets[row + 1] += offsets[row];
        }
        columns.clear();
        columns.resize(self.lower.columns.len(), 0);
        blocks.clear();
        blocks.resize(self.lower.blocks.len(), T::ZERO);
        self.mirror.clear();
        // Slots are free until the elimination; they count how far each row is.
        self.slots.copy_from_slice(&offsets[..count]);
        for row in 0..count {
            for place in self.lower.row(row) {
                let slot = &mut self.slots[self.lower.columns[place] as usize];
                columns[*slot as usize] = row as u32;
                self.mirror.push(*slot);
                *slot += 1;
            }
        }
        self.slots.fill(NONE);
    }

    /// Row by row: W = L D of the row from those before it, then its L, then its pivot.
    #[inline(always)]
    fn factorise(&mut self, matrix: &BlockMatrix<T>, filters: &ParticleFilters<T>) {
        for row in 0..self.inverse.len() {
            let own = self.lower.row(row);
            for place in own.clone() {
                self.slots[self.lower.columns[place] as usize] = place as u32;
            }
            for place in own.clone() {
                let pivot = self.lower.columns[place] as usize;
                let mut w = load(&self.lower.blocks, place);
                for other in self.lower.row(pivot) {
                    let slot = self.slots[self.lower.columns[other] as usize];
                    if slot != NONE {
                        let left = load(&self.scaled, slot as usize);
                        subtract(&mut w, &left, &self.lower.blocks[other * SIZE..][..SIZE]);
                    }
                }
                store(&mut self.scaled, place, &w);
                let l = scale(&w, &self.inverse[pivot]);
                store(&mut self.lower.blocks, place, &l);
            }
            let original = diagonal(matrix, filters, self.first + row);
            let mut pivot = columns_of(&original);
            for place in own.clone() {
                let left = load(&self.scaled, place);
                subtract(&mut pivot, &left, &self.lower.blocks[place * SIZE..][..SIZE]);
            }
            let [[xx, xy, xz, _], [_, yy, yz, _], [_, _, zz, _]] = pivot;
            let left = [xx, yy, zz, xy, xz, yz];
            let inverse =
                if is_definite(&left, &original) { invert(left) } else { invert(original) };
            self.inverse[row] = inverse;
            for place in own {
                self.slots[self.lower.columns[place] as usize] = NONE;
                let l = load(&self.lower.blocks, place);
                let transposed = std::array::from_fn(|column| {
                    [l[0][column], l[1][column], l[2][column], T::ZERO]
                });
                store(&mut self.upper.blocks, self.mirror[place] as usize, &transposed);
            }
        }
    }

    /// Forward, pivots, backward.
    #[inline(always)]
    fn solve(&mut self, from: FieldView<'_, T>, to: &mut [&mut [T]; 3]) {
        let count = self.inverse.len();
        for row in 0..count {
            let [x, y, z] = from.get(self.first + row);
            self.vector[row] = self.lower.eliminate(row, [x, y, z, T::ZERO], &self.vector);
        }
        for row in (0..count).rev() {
            let [x, y, z, _] = self.vector[row];
            let [x, y, z] = times(&self.inverse[row], [x, y, z]);
            let solved = self.upper.eliminate(row, [x, y, z, T::ZERO], &self.vector);
            self.vector[row] = solved;
            for axis in 0..3 {
                to[axis][row] = solved[axis];
            }
        }
    }
}

impl<T: Real> Rows<T> {
    fn clear(&mut self) {
        self.offsets.clear();
        self.offsets.push(0);
        self.columns.clear();
        self.blocks.clear();
    }

    #[inline(always)]
    fn row(&self, row: usize) -> std::ops::Range<usize> {
        self.offsets[row] as usize..self.offsets[row + 1] as usize
    }

    fn push(&mut self, column: u32, block: &[[T; 3]; 3]) {
        self.columns.push(column);
        for column in 0..3 {
            self.blocks.extend(block.iter().map(|row| row[column]));
        }
    }

    fn add(&mut self, place: usize, block: &[[T; 3]; 3]) {
        let entries = self.blocks[place * SIZE..].iter_mut();
        for (number, entry) in entries.take(SIZE).enumerate() {
            *entry += block[number % 3][number / 3];
        }
    }

    /// Ends the row that starts at a place, columns ascending.
    fn row_end(&mut self, start: usize) {
        // Sorted but for what contact has added.
        for end in start + 1..self.columns.len() {
            let mut place = end;
            while place > start && self.columns[place - 1] > self.columns[place] {
                self.columns.swap(place - 1, place);
                for entry in 0..SIZE {
                    self.blocks.swap((place - 1) * SIZE + entry, place * SIZE + entry);
                }
                place -= 1;
            }
        }
        self.offsets.push(self.columns.len() as u32);
    }

    /// `value` less the blocks of a row times their vectors. The three columns of all blocks are
    /// summed apart, which hides the latency of additions, and then together.
    #[inline(always)]
    fn eliminate(&self, row: usize, value: [T; 4], vectors: &[[T; 4]]) -> [T; 4] {
        let mut sums = [value, [T::ZERO; 4], [T::ZERO; 4]];
        for place in self.row(row) {
            let block = load(&self.blocks, place);
            let vector = &vectors[self.columns[place] as usize];
            for column in 0..3 {
                for lane in 0..4 {
                    sums[column][lane] -= block[column][lane] * vector[column];
                }
            }
        }
        std::array::from_fn(|lane| sums[0][lane] + (sums[1][lane] + sums[2][lane]))
    }
}

/// Columns of a block, each loaded as four numbers, the last of which means nothing.
type Columns<T> = [[T; 4]; 3];

#[inline(always)]
fn load<T: Real>(blocks: &[T], place: usize) -> Columns<T> {
    let block = &blocks[place * SIZE..][..SIZE + 1];
    let column =
        |start: usize| [block[start], block[start + 1], block[start + 2], block[start + 3]];
    [column(0), column(3), column(6)]
}

#[inline(always)]
fn store<T: Real>(blocks: &mut [T], place: usize, columns: &Columns<T>) {
    let block = &mut blocks[place * SIZE..][..SIZE];
    for (entries, column) in block.chunks_exact_mut(3).zip(columns) {
        entries.copy_from_slice(&column[..3]);
    }
}

#[inline(always)]
fn columns_of<T: Real>(block: &Symmetric<T>) -> Columns<T> {
    rows(block).map(|[x, y, z]| [x, y, z, T::ZERO])
}

/// a -= b c^T, c column by column.
#[inline(always)]
fn subtract<T: Real>(a: &mut Columns<T>, b: &Columns<T>, c: &[T]) {
    for column in 0..3 {
        for k in 0..3 {
            let factor = c[3 * k + column];
            for lane in 0..4 {
                a[column][lane] -= b[k][lane] * factor;
            }
        }
    }
}

/// a b, b symmetric.
#[inline(always)]
fn scale<T: Real>(a: &Columns<T>, b: &Symmetric<T>) -> Columns<T> {
    rows(b).map(|[x, y, z]| {
        std::array::from_fn(|lane| a[0][lane] * x + a[1][lane] * y + a[2][lane] * z)
    })
}

/// The diagonal block of S A S + (I - S), with the trace of A in place of 1, so that single precision
/// has room for it.
#[inline(always)]
fn diagonal<T: Real>(
    matrix: &BlockMatrix<T>,
    filters: &ParticleFilters<T>,
    particle: usize,
) -> Symmetric<T> {
    let block = matrix.diagonal[particle];
    filters.get(particle).map_or(block, |filter| super::preconditioner::restrict(&block, filter))
}

/// Whether what is left of a block has pivots above a share of its trace.
#[inline(always)]
fn is_definite<T: Real>([xx, yy, zz, xy, xz, yz]: &Symmetric<T>, original: &Symmetric<T>) -> bool {
    let least = T::from_f64(PIVOT_MIN) * (original[0] + original[1] + original[2]);
    let (a, b) = (*xy / *xx, *xz / *xx);
    let second = *yy - a * *xy;
    let mixed = *yz - a * *xz;
    let third = *zz - b * *xz - mixed / second * mixed;
    *xx > least && second > least && third > least
}

/// One part, compiled for each instruction set.
struct FactoriseTask<'a, T> {
    part: &'a mut Part<T>,
    matrix: &'a BlockMatrix<T>,
    filters: &'a ParticleFilters<T>,
}

impl<T: Real> NullaryFnOnce for FactoriseTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.part.factorise(self.matrix, self.filters);
    }
}

/// One part, compiled for each instruction set.
struct ApplyTask<'a, 'b, T> {
    part: &'a mut Part<T>,
    from: FieldView<'a, T>,
    to: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for ApplyTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        self.part.solve(self.from, &mut self.to);
    }
}

#[cfg(test)]
mod tests {
    use super::super::block_matrix::tests::{Numbers, random_matrix, random_pairs};
    use super::*;

    fn apply<T: Real>(
        factorisation: &mut IncompleteCholesky<T>,
        from: &VectorField<T>,
        count: usize,
    ) -> VectorField<T> {
        let mut to = VectorField::new(count, 2);
        factorisation.apply(from, &mut to, pulp::Arch::new());
        to
    }

    fn dot(a: &VectorField<f64>, b: &VectorField<f64>, count: usize) -> f64 {
        let term = |i: usize| crate::vector::dot(a.get(i), b.get(i));
        (0..count).map(term).sum()
    }

    /// A chain has no fill, so that nothing is incomplete about its factorisation.
    #[test]
    fn a_chain_is_solved_exactly() {
        let count = 500_u32;
        let springs: Vec<_> = (1..count).map(|j| [j - 1, j]).collect();
        let mut numbers = Numbers::new(8);
        let matrix = random_matrix::<f64>(count as usize, &springs, &[], &mut numbers);
        let expected = numbers.field::<f64>(count as usize);
        let mut image = VectorField::new(count as usize, 0);
        matrix.apply(&expected, &mut image);
        let mut factorisation = IncompleteCholesky::default();
        let filters = ParticleFilters::new(count as usize);
        factorisation.build(&matrix, &filters, pulp::Arch::new());
        let found = apply(&mut factorisation, &image, count as usize);
        for i in 0..count as usize {
            for axis in 0..3 {
                let error = found.get(i)[axis] - expected.get(i)[axis];
                assert!(error.abs() < 1e-10, "{i}: {error:e}");
            }
        }
    }

    /// A spring and a contact of the same pair are one block: the chain again, its springs doubled by
    /// contacts, and with constraints.
    #[test]
    fn contacts_and_constraints_belong_to_the_matrix() {
        let count = 60_usize;
        let springs: Vec<_> = (1..count as u32).map(|j| [j - 1, j]).collect();
        let mut numbers = Numbers::new(18);
        let matrix = random_matrix::<f64>(count, &springs, &springs, &mut numbers);
        let mut filters = ParticleFilters::new(count);
        filters.set(7, [0.0; 6]);
        filters.set(20, [1.0, 0.36, 0.64, 0.0, 0.0, 0.48]);
        let filter = |field: &mut VectorField<f64>| {
            for (particle, filter) in filters.iter() {
                let i = *particle as usize;
                field.set(i, times(filter, field.get(i)));
            }
        };
        let mut expected = numbers.field::<f64>(count);
        filter(&mut expected);
        let mut image = VectorField::new(count, 0);
        matrix.apply(&expected, &mut image);
        filter(&mut image);
        let mut factorisation = IncompleteCholesky::default();
        factorisation.build(&matrix, &filters, pulp::Arch::new());
        let found = apply(&mut factorisation, &image, count);
        for i in 0..count {
            for axis in 0..3 {
                let error = found.get(i)[axis] - expected.get(i)[axis];
                assert!(error.abs() < 1e-10, "{i}: {error:e}");
            }
        }
    }

    /// Symmetric and positive definite, whatever the matrix; and the same bits on any number of
    /// threads.
    #[test]
    fn the_preconditioner_is_symmetric_and_positive_definite() {
        let mut numbers = Numbers::new(28);
        for (count, degree) in [(1, 0), (40, 8), (5000, 6)] {
            let springs = random_pairs(count, degree * count, &mut numbers);
            let contacts = random_pairs(count, count / 2, &mut numbers);
            let matrix = random_matrix::<f64>(count, &springs, &contacts, &mut numbers);
            let filters = ParticleFilters::new(count);
            let [mut one, mut two] = [IncompleteCholesky::default(), IncompleteCholesky::default()];
            one.build(&matrix, &filters, pulp::Arch::new());
            let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
            pool.install(|| two.build(&matrix, &filters, pulp::Arch::Scalar));
            for _ in 0..4 {
                let [a, b] = [numbers.field::<f64>(count), numbers.field(count)];
                let [pa, pb] = [&a, &b].map(|field| apply(&mut one, field, count));
                let (left, right) = (dot(&a, &pb, count), dot(&pa, &b, count));
                let size = dot(&a, &pa, count) + dot(&b, &pb, count);
                assert!((left - right).abs() < 1e-10 * size, "{count}: {left} {right}");
                assert!(dot(&a, &pa, count) > 0.0, "{count}");
                let other = pool.install(|| apply(&mut two, &a, count));
                assert!((0..count).all(|i| other.get(i) == pa.get(i)), "{count}");
            }
        }
    }

    /// Pivots that fail are replaced: an indefinite matrix still gives finite numbers.
    #[test]
    fn a_matrix_that_is_not_definite_gives_finite_numbers() {
        let mut numbers = Numbers::new(38);
        let springs = random_pairs(80, 300, &mut numbers);
        let mut matrix = random_matrix::<f32>(80, &springs, &[], &mut numbers);
        for i in (0..80).step_by(3) {
            for entry in 0..6 {
                matrix.diagonal[i][entry] *= 0.02;
            }
        }
        let mut factorisation = IncompleteCholesky::default();
        factorisation.build(&matrix, &ParticleFilters::new(80), pulp::Arch::new());
        let found = apply(&mut factorisation, &numbers.field(80), 80);
        assert!((0..80).all(|i| found.get(i).iter().all(|value| value.is_finite())));
    }
}
