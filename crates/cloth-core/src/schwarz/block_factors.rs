//! Inverse Cholesky factors of dense diagonal blocks: what smooths levels above the particles.
//!
//! A block A is scaled to unit diagonal, d A d with d_k = 1/sqrt(A_kk), and factorised as L L^T in double precision. Kept are the
//! rows w_k of L^-1 in single precision and d, so that the approximate inverse is
//!
//! ```text
//! d (sum over k of w_k w_k^T) d,
//! ```
//!
//! symmetric and positive definite whatever rounding and however old it is, and one stream of memory in which each row is read once.
//! Rows are filled up with zeros to whole chunks of 16: row k has k / 16 + 1 of them.

use pulp::{NullaryFnOnce, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{LANES as CHUNK, add_product, products, tree, widen};

/// Sums over rows that are added at last, row k to number k % 8.
const SUMS: usize = 8;

/// What a product needs beside its vectors, in vectors: one, a row, and the sums.
pub(super) const SCRATCH: usize = 2 + SUMS;

/// Rows that an elimination takes at once.
const STEP: usize = 4;

/// Rows after which all threads work on those below, and of a matrix that is worth it.
const PANEL: usize = 32;
const SHARED_MIN: usize = 160;

/// Rows in one task.
const TASK: usize = 16;

/// A pivot that is not above this share of its diagonal entry counts as 1: rounding has left nothing of it, or it has no entry.
const PIVOT_MIN: f64 = 1e-12;

/// Factors of blocks along the diagonal of a matrix.
#[derive(Debug, Default)]
pub struct BlockFactors {
    /// Where the unknowns of each block start, and the end.
    starts: Vec<usize>,
    /// Where the rows of each block start, and the end.
    row_starts: Vec<usize>,
    rows: Vec<f32>,
    scale: Vec<f64>,
}

/// One block to factorise into.
pub(super) struct FactorTask<'a> {
    rows: &'a mut [f32],
    scale: &'a mut [f64],
}

/// Memory for factorisations of blocks up to some size.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    size: usize,
    stride: usize,
    matrix: Vec<f64>,
    inverse: Vec<f64>,
    scale: Vec<f64>,
}

impl Workspace {
    /// A matrix of zeros.
    pub(super) fn begin(&mut self, size: usize) {
        self.size = size;
        self.stride = size.next_multiple_of(CHUNK);
        self.matrix.clear();
        self.matrix.resize(size * self.stride, 0.0);
        self.inverse.clear();
        self.inverse.resize(size * self.stride, 0.0);
    }

    /// Adds to an entry on the diagonal or right of it; others are those of the transpose.
    #[inline(always)]
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) {
        self.matrix[row * self.stride + column] += value;
    }
}

impl BlockFactors {
    /// Memory for blocks of these sizes.
    pub(super) fn new(sizes: impl Iterator<Item = usize>) -> Self {
        let (mut starts, mut row_starts) = (vec![0], vec![0]);
        for size in sizes {
            starts.push(starts[starts.len() - 1] + size);
            row_starts.push(row_starts[row_starts.len() - 1] + packed(size));
        }
        let [unknowns, entries] = [&starts, &row_starts].map(|starts| starts[starts.len() - 1]);
        Self { starts, row_starts, rows: vec![0.0; entries], scale: vec![0.0; unknowns] }
    }

    /// The rows of all blocks, one block after the other.
    #[must_use]
    pub fn rows(&self) -> &[f32] {
        &self.rows
    }

    /// d of all unknowns.
    #[must_use]
    pub fn scale(&self) -> &[f64] {
        &self.scale
    }

    /// The blocks, in order, to factorise into.
    pub(super) fn tasks(&mut self) -> Vec<FactorTask<'_>> {
        let mut rows = self.rows.as_mut_slice();
        let mut scale = self.scale.as_mut_slice();
        let ends = self.starts.windows(2).zip(self.row_starts.windows(2));
        ends.map(|(unknowns, entries)| FactorTask {
            rows: rows.split_off_mut(..entries[1] - entries[0]).unwrap_or_default(),
            scale: scale.split_off_mut(..unknowns[1] - unknowns[0]).unwrap_or_default(),
        })
        .collect()
    }

    /// out = the inverse of a block, as it is kept, times `from`. `scratch` has [`SCRATCH`] times the size of the block, in whole chunks.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(
        &self,
        simd: S,
        block: usize,
        (from, out): (&[f64], &mut [f64]),
        scratch: &mut [f64],
    ) {
        let size = from.len();
        let padded = size.next_multiple_of(CHUNK);
        let (scaled, scratch) = scratch[..SCRATCH * padded].split_at_mut(padded);
        let (wide, sums) = scratch.split_at_mut(padded);
        scaled[size..].fill(0.0);
        sums.fill(0.0);
        let scale = &self.scale[self.starts[block]..][..size];
        for ((scaled, from), scale) in scaled.iter_mut().zip(from).zip(scale) {
            *scaled = *scale * *from;
        }
        let (scaled, _) = S::as_simd_f64s(scaled);
        let (sums, _) = S::as_mut_simd_f64s(sums);
        let registers = padded / S::F64_LANES;
        let mut rows = &self.rows[self.row_starts[block]..];
        for k in 0..size {
            let (row, rest) = rows.split_at(CHUNK * (k / CHUNK + 1));
            rows = rest;
            let wide = &mut wide[..row.len()];
            widen(row, wide);
            let (row, _) = S::as_simd_f64s(wide);
            let product = simd.splat_f64s(tree(products(simd, row, scaled)));
            for (row, sum) in row.iter().zip(&mut sums[k % SUMS * registers..]) {
                add_product(simd, sum, *row, product);
            }
        }
        let mut half = SUMS / 2;
        while half > 0 {
            let (to, from) = sums.split_at_mut(half * registers);
            for (to, from) in to.iter_mut().zip(from) {
                *to = simd.add_f64s(*to, *from);
            }
            half /= 2;
        }
        S::as_mut_simd_f64s(wide).0.copy_from_slice(&sums[..registers]);
        for ((out, scale), sum) in out.iter_mut().zip(scale).zip(wide) {
            *out = *scale * *sum;
        }
    }

    /// The inverse of a block, as it is kept, as a whole matrix, row by row.
    pub(super) fn inverse(&self, block: usize, arch: pulp::Arch) -> Vec<f64> {
        let size = self.starts[block + 1] - self.starts[block];
        let scale = &self.scale[self.starts[block]..][..size];
        let rows = &self.rows[self.row_starts[block]..];
        let mut inverse = vec![0.0; size * size];
        let lines = inverse.par_chunks_mut(size.max(1)).enumerate();
        lines.for_each(|(i, out)| arch.dispatch(InverseLine { rows, scale, i, out }));
        for i in 0..size {
            for j in 0..i {
                inverse[j * size + i] = inverse[i * size + j];
            }
        }
        inverse
    }
}

/// A line of an inverse up to its diagonal, from the rows of its factor, compiled for each instruction set.
struct InverseLine<'a, 'b> {
    rows: &'a [f32],
    scale: &'a [f64],
    i: usize,
    out: &'b mut [f64],
}

impl NullaryFnOnce for InverseLine<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows, scale, i, out } = self;
        let (size, out) = (out.len(), &mut out[..=i]);
        for k in i..size {
            let row = &rows[packed(k)..][..=i];
            let own = f64::from(row[i]);
            for (out, entry) in out.iter_mut().zip(row) {
                *out += own * f64::from(*entry);
            }
        }
        for (out, other) in out.iter_mut().zip(scale) {
            *out *= scale[i] * other;
        }
    }
}

/// Some rows of a matrix times a vector, compiled for each instruction set: sums in lanes over whole chunks of a row, and then over lanes.
pub(super) struct DenseRows<'a, 'b> {
    pub(super) rows: &'a [f64],
    pub(super) x: &'a [f64],
    pub(super) to: &'b mut [f64],
}

impl WithSimd for DenseRows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, x, to } = self;
        let whole = x.len() / CHUNK * CHUNK;
        for (to, row) in to.iter_mut().zip(rows.chunks_exact(x.len().max(1))) {
            let [(a, _), (b, _)] = [&row[..whole], &x[..whole]].map(S::as_simd_f64s);
            let mut lanes = products(simd, a, b);
            for (lane, (entry, x)) in lanes.iter_mut().zip(row[whole..].iter().zip(&x[whole..])) {
                *lane += entry * x;
            }
            *to = tree(lanes);
        }
    }
}

/// Entries of the rows of a block.
const fn packed(size: usize) -> usize {
    let whole = size / CHUNK;
    CHUNK * (CHUNK * whole * (whole + 1) / 2 + (size % CHUNK) * (whole + 1))
}

impl FactorTask<'_> {
    /// Factorises the matrix of the workspace, which is used up.
    pub(super) fn factorise(&mut self, work: &mut Workspace, arch: pulp::Arch) {
        arch.dispatch(Factorise { work, arch });
        let Workspace { size, stride, inverse, scale, .. } = &*work;
        let mut rows = &mut *self.rows;
        for k in 0..*size {
            let (row, rest) = rows.split_at_mut(CHUNK * (k / CHUNK + 1));
            for (to, from) in row.iter_mut().zip(&inverse[k * stride..]) {
                *to = *from as f32;
            }
            rows = rest;
        }
        self.scale.copy_from_slice(scale);
    }
}

/// Scaling, factorisation and inverse of the factor, compiled for each instruction set.
struct Factorise<'a> {
    work: &'a mut Workspace,
    arch: pulp::Arch,
}

impl NullaryFnOnce for Factorise<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Workspace { size, stride, matrix, inverse, scale } = self.work;
        let (size, stride) = (*size, *stride);
        scale.clear();
        scale.extend((0..size).map(|k| {
            let entry = matrix[k * stride + k];
            if entry > 0.0 && entry.is_finite() { 1.0 / entry.sqrt() } else { 1.0 }
        }));
        for k in 0..size {
            let row = &mut matrix[k * stride + k..k * stride + size];
            for (entry, other) in row.iter_mut().zip(&scale[k..]) {
                *entry *= scale[k] * other;
            }
        }
        let panel = if size < SHARED_MIN { size } else { PANEL };
        for first in (0..size).step_by(panel.max(1)) {
            cholesky(matrix, [first, size.min(first + panel), size], stride, self.arch);
        }
        for first in (0..size).step_by(panel.max(1)) {
            invert(matrix, inverse, [first, size.min(first + panel)], stride, self.arch);
        }
    }
}

/// The transposed factor in place of the upper triangle, its diagonal as reciprocals: rows from `begin` to `end`, and what the rows below take from them. All rows
/// before are done.
#[inline(always)]
fn cholesky(matrix: &mut [f64], [begin, end, size]: [usize; 3], stride: usize, arch: pulp::Arch) {
    let (head, below) = matrix.split_at_mut(end * stride);
    for first in (begin..end).step_by(STEP) {
        let last = end.min(first + STEP);
        let (head, rest) = head.split_at_mut(last * stride);
        let panel = &mut head[first * stride..];
        for k in first..last {
            let (above, below) = panel.split_at_mut((k - first + 1) * stride);
            let row = &mut above[(k - first) * stride..][..size];
            let pivot = if row[k] > PIVOT_MIN { row[k] } else { 1.0 };
            let reciprocal = 1.0 / pivot.sqrt();
            row[k + 1..].iter_mut().for_each(|entry| *entry *= reciprocal);
            row[k] = reciprocal;
            for (i, below) in (k + 1..last).zip(below.chunks_exact_mut(stride)) {
                let factor = row[i];
                for (entry, other) in below[i..size].iter_mut().zip(&row[i..]) {
                    *entry -= factor * other;
                }
            }
        }
        for (i, to) in (last..end).zip(rest.chunks_exact_mut(stride)) {
            CholeskyRow { to: &mut to[i..size], done: panel, stride, i, count: last - first }
                .call();
        }
    }
    let done = &head[begin * stride..];
    let below = below.par_chunks_exact_mut(stride).enumerate();
    below.with_min_len(TASK).for_each(|(at, to)| {
        let i = end + at;
        let to = &mut to[i..size];
        arch.dispatch(CholeskyRow { to, done, stride, i, count: end - begin });
    });
}

/// What row i of the matrix, from its diagonal on, takes from `count` rows that are done.
struct CholeskyRow<'a> {
    to: &'a mut [f64],
    done: &'a [f64],
    stride: usize,
    i: usize,
    count: usize,
}

impl NullaryFnOnce for CholeskyRow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { to, done, stride, i, count } = self;
        for first in (0..count).step_by(STEP) {
            eliminate(
                to,
                STEP.min(count - first),
                #[inline(always)]
                |k| (done[(first + k) * stride + i], &done[(first + k) * stride + i..]),
            );
        }
    }
}

/// The inverse of the factor, row by row: w_i = (e_i - sum over j < i of L_ij w_j) / L_ii. As above, rows from `begin` to `end`.
#[inline(always)]
fn invert(
    matrix: &[f64],
    inverse: &mut [f64],
    [begin, end]: [usize; 2],
    stride: usize,
    arch: pulp::Arch,
) {
    let (head, below) = inverse.split_at_mut(end * stride);
    for i in begin..end {
        let (done, rest) = head.split_at_mut(i * stride);
        let to = &mut rest[..stride];
        InverseRow { to, matrix, done, stride, i, begin, end: i }.call();
        let reciprocal = matrix[i * stride + i];
        to[..i].iter_mut().for_each(|entry| *entry *= reciprocal);
        to[i] = reciprocal;
    }
    let done = &*head;
    let below = below.par_chunks_exact_mut(stride).enumerate();
    below.with_min_len(TASK).for_each(|(at, to)| {
        arch.dispatch(InverseRow { to, matrix, done, stride, i: end + at, begin, end });
    });
}

/// What row i of the inverse takes from those from `begin` to `end`.
struct InverseRow<'a> {
    to: &'a mut [f64],
    matrix: &'a [f64],
    done: &'a [f64],
    stride: usize,
    i: usize,
    begin: usize,
    end: usize,
}

impl NullaryFnOnce for InverseRow<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { to, matrix, done, stride, i, begin, end } = self;
        for first in (begin..end).step_by(STEP) {
            let last = end.min(first + STEP);
            eliminate(
                &mut to[..last],
                last - first,
                #[inline(always)]
                |k| (matrix[(first + k) * stride + i], &done[(first + k) * stride..]),
            );
        }
    }
}

/// to -= the sum of `count` rows, at most [`STEP`], each times a number: `term` gives number and row of each.
#[inline(always)]
fn eliminate<'a>(to: &mut [f64], count: usize, term: impl Fn(usize) -> (f64, &'a [f64])) {
    let length = to.len();
    if count == STEP {
        let factors: [f64; STEP] = std::array::from_fn(|k| term(k).0);
        let rows: [&[f64]; STEP] = std::array::from_fn(|k| &term(k).1[..length]);
        for j in 0..length {
            to[j] = to[j]
                - factors[0] * rows[0][j]
                - factors[1] * rows[1][j]
                - factors[2] * rows[2][j]
                - factors[3] * rows[3][j];
        }
    } else {
        for k in 0..count {
            let (factor, row) = term(k);
            for (to, other) in to.iter_mut().zip(row) {
                *to -= factor * other;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factors(size: usize, entry: impl Fn(usize, usize) -> f64) -> BlockFactors {
        let mut factors = BlockFactors::new([size].into_iter());
        let mut work = Workspace::default();
        work.begin(size);
        for row in 0..size {
            (row..size).for_each(|column| work.add(row, column, entry(row, column)));
        }
        factors.tasks()[0].factorise(&mut work, pulp::Arch::new());
        factors
    }

    /// The first block of factors, times a vector.
    struct Apply<'a>(&'a BlockFactors, &'a [f64], &'a mut [f64]);

    impl WithSimd for Apply<'_> {
        type Output = ();

        fn with_simd<S: Simd>(self, simd: S) {
            let Self(factors, from, out) = self;
            let mut scratch = vec![f64::NAN; SCRATCH * (from.len() + CHUNK)];
            factors.apply(simd, 0, (from, out), &mut scratch);
        }
    }

    /// With registers of one lane the bits are those of wide ones.
    fn apply(factors: &BlockFactors, from: &[f64], out: &mut [f64]) {
        let mut narrow = vec![0.0; out.len()];
        Apply(factors, from, &mut narrow).with_simd(pulp::Scalar);
        pulp::Arch::new().dispatch(Apply(factors, from, out));
        assert!(narrow == out, "{narrow:?} {out:?}");
    }

    #[test]
    fn blocks_are_inverted_at_every_size() {
        for size in [1, 2, 3, 4, 5, 15, 16, 17, 31, 48, 93, 96, 384] {
            // Inverse of a matrix with 1 / (1 + |i - j|) off a heavy diagonal; masses over ten decades.
            let mass = |k: usize| 10_f64.powi((k % 11) as i32 - 5);
            let entry = |i: usize, j: usize| {
                let distance = i.abs_diff(j) as f64;
                let heavy = if i == j { 2.0 } else { 0.0 };
                (mass(i) * mass(j)).sqrt() * (heavy + 1.0 / (1.0 + distance))
            };
            let factors = factors(size, entry);
            let x: Vec<f64> = (0..size).map(|k| (k as f64).sin() / mass(k).sqrt()).collect();
            let product: Vec<f64> =
                (0..size).map(|i| (0..size).map(|j| entry(i, j) * x[j]).sum()).collect();
            let mut found = vec![0.0; size];
            apply(&factors, &product, &mut found);
            for k in 0..size {
                let error = (found[k] - x[k]).abs() * mass(k).sqrt();
                assert!(error < 1e-5, "{size}: {} {}", found[k], x[k]);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_definite_gives_one_that_is() {
        for entry in [
            (|_, _| 0.0) as fn(usize, usize) -> f64,
            |i, j| if i == j { 1.0 } else { 1.0 + 1e-9 },
            |i, j| if i == j { -1.0 } else { 0.5 },
        ] {
            let factors = factors(20, entry);
            let from: Vec<f64> = (0..20).map(|k| f64::from(k) - 9.7).collect();
            let mut found = vec![0.0; 20];
            apply(&factors, &from, &mut found);
            let product: f64 = from.iter().zip(&found).map(|(a, b)| a * b).sum();
            assert!(product > 0.0 && product.is_finite());
        }
    }
}
