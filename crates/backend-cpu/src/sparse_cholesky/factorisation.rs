//! Sparse Cholesky factorisation by faer, in double precision.

use cloth_core::{Error, Result};
use faer::{
    Conj, MatMut, Par, Side,
    dyn_stack::{MemBuffer, MemStack},
    perm::PermRef,
    sparse::{
        FaerError, SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            SupernodalThreshold,
            cholesky::{
                CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw,
                SymmetricOrdering, factorize_symbolic_cholesky,
                supernodal::SymbolicSupernodalCholesky,
            },
        },
    },
};

use super::pattern::LowerPattern;

/// A matrix P A P^T = L L^T of fixed pattern, factorised as often as its numbers change, always in
/// the same memory.
///
/// L consists of supernodes: runs of columns that have their rows in common, kept as dense
/// matrices. It is computed on one thread, so that its bits do not depend on how many there are.
pub(crate) struct SparseCholesky {
    pattern: LowerPattern,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
}

/// The matrix is not positive definite to rounding, or has numbers that are not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite;

/// Columns of L with the same rows below them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Supernode<'a> {
    /// First column.
    pub(crate) first: usize,
    /// Number of columns.
    pub(crate) columns: usize,
    /// Rows below the triangle, ascending.
    pub(crate) rows: &'a [usize],
    /// Triangle and rows below, column by column; what is above the diagonal means nothing.
    pub(crate) values: &'a [f64],
}

impl SparseCholesky {
    /// Analyses a pattern; `order` is the order of elimination, or `None` to have one found by
    /// approximate minimum degree (Amestoy, Davis and Duff 1996).
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(pattern: LowerPattern, order: Option<&[usize]>) -> Result<Self> {
        let out_of_memory = |_: FaerError| Error::OutOfMemory {
            requested: (8 * pattern.rows.len()) as u64,
            available: 0,
        };
        let mut inverse = vec![0; order.map_or(0, <[usize]>::len)];
        for (place, &index) in order.into_iter().flatten().enumerate() {
            inverse[index] = place;
        }
        let ordering = order.map_or(SymmetricOrdering::Amd, |order| {
            SymmetricOrdering::Custom(PermRef::new_checked(order, &inverse, pattern.len()))
        });
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic = factorize_symbolic_cholesky(
            symbolic_matrix(&pattern),
            Side::Lower,
            ordering,
            parameters,
        )
        .map_err(out_of_memory)?;
        let factor = vec![0.0; symbolic.len_val()];
        let scratch = symbolic
            .factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let scratch = MemBuffer::try_new(scratch)
            .map_err(|_| Error::OutOfMemory { requested: 0, available: 0 })?;
        Ok(Self { pattern, symbolic, factor, scratch })
    }

    pub(crate) fn pattern(&self) -> &LowerPattern {
        &self.pattern
    }

    /// Factorises the matrix with these numbers, in the order of the pattern.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`]; the factor is then of no use.
    pub(crate) fn factorise(&mut self, values: &[f64]) -> Result<(), NotPositiveDefinite> {
        let matrix = SparseColMatRef::new(symbolic_matrix(&self.pattern), values);
        let stack = MemStack::new(&mut self.scratch);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            )
            .map_err(|_| NotPositiveDefinite)?;
        // A pivot that is infinite or NaN is not an error to faer.
        let is_good = |pivot: f64| pivot > 0.0 && pivot.is_finite();
        let all_good = self.supernodes().all(|node| {
            let stride = node.columns + node.rows.len() + 1;
            node.values.iter().step_by(stride).take(node.columns).all(|&pivot| is_good(pivot))
        });
        if all_good { Ok(()) } else { Err(NotPositiveDefinite) }
    }

    /// Solves A x = b for one right-hand side, in place, on one thread.
    pub(crate) fn solve_in_place(&mut self, right_side: &mut [f64]) {
        let stack = MemStack::new(&mut self.scratch);
        let count = right_side.len();
        LltRef::<usize, f64>::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(right_side, count, 1),
            Par::Seq,
            stack,
        );
    }

    /// The row and column of A that each row and column of L belongs to.
    pub(crate) fn order(&self) -> &[usize] {
        self.symbolic.perm().map_or(&[], |permutation| permutation.arrays().0)
    }

    /// All supernodes, columns ascending.
    pub(crate) fn supernodes(&self) -> impl Iterator<Item = Supernode<'_>> {
        let symbolic: Option<&SymbolicSupernodalCholesky<usize>> = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => Some(symbolic),
            // Not with the threshold of `new`.
            SymbolicCholeskyRaw::Simplicial(_) => None,
        };
        symbolic.into_iter().flat_map(|symbolic| {
            (0..symbolic.n_supernodes()).map(|number| {
                let first = symbolic.supernode_begin()[number];
                let columns = symbolic.supernode_end()[number] - first;
                let offsets = symbolic.col_ptr_for_val();
                Supernode {
                    first,
                    columns,
                    rows: symbolic.supernode(number).pattern(),
                    values: &self.factor[offsets[number]..offsets[number + 1]],
                }
            })
        })
    }
}

fn symbolic_matrix(pattern: &LowerPattern) -> SymbolicSparseColMatRef<'_, usize> {
    let count = pattern.len();
    SymbolicSparseColMatRef::new_checked(count, count, &pattern.offsets, None, &pattern.rows)
}
