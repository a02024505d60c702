//! NUMERICS §5, `direct_solve`: sparse Cholesky factorisation in double precision.

use cloth_core::{LinearOutcome, Real, Result};

use super::{
    block_matrix::{BlockMatrix, times},
    matrix::Symmetric,
    particle_filters::ParticleFilters,
    preconditioner::restrict,
};
use crate::{
    memory::VectorField,
    sparse_cholesky::{LowerPattern, Neighbourhood, SparseCholesky, nested_dissection},
};

/// A block off the diagonal that is not symmetric: row and column, the smaller one first, and its entries.
pub(super) type FullBlock<T> = (u32, u32, [[T; 3]; 3]);

/// The factorisation, analysed for one pattern and used as long as that fits.
pub(crate) struct DirectSolver {
    positions: Vec<[f64; 3]>,
    springs: Vec<[u32; 2]>,
    analysis: Option<Analysis>,
    values: Vec<f64>,
    /// x, and before that its right-hand side.
    change: Vec<f64>,
}

struct Analysis {
    /// Pairs in contact that no spring joins, sorted.
    contacts: Vec<[u32; 2]>,
    neighbourhood: Neighbourhood,
    factorisation: SparseCholesky,
}

impl DirectSolver {
    /// A solver for springs between these pairs of particles, which lie at `positions` \[m\] at
    /// rest.
    pub(crate) fn new(positions: &[[f64; 3]], springs: Vec<[u32; 2]>) -> Self {
        Self {
            positions: positions.to_vec(),
            springs,
            analysis: None,
            values: Vec::new(),
            change: Vec::new(),
        }
    }

    /// Solves A y = b with y = z in the constrained directions; `solution` holds z at first, then y.
    ///
    /// The residual is that of y in double precision. It is |S (b - A y)| relative to
    /// |S (b - A z)|, and counts as converged within 10^-4 in single and 10^-10 in double
    /// precision: S is rounded, and so no projector but for eps, which the condition number of A
    /// makes larger. A pivot that is not positive, or not finite, is a breakdown, and the solution is
    /// left as it is.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn solve<T: Real>(
        &mut self,
        (matrix, others): (&BlockMatrix<T>, &[FullBlock<T>]),
        filters: &ParticleFilters<T>,
        right_side: &VectorField<T>,
        solution: &mut VectorField<T>,
    ) -> Result<LinearOutcome> {
        let count = matrix.count();
        let read = |field: &VectorField<T>| {
            (0..count).map(|i| field.get(i).map(T::to_f64)).collect::<Vec<[f64; 3]>>()
        };
        let (right_side, start) = (read(right_side), read(solution));
        let residual = residual((matrix, others), filters, &right_side, &start);
        let reference = norm(&residual);
        let broken =
            LinearOutcome { residual: f64::INFINITY, breakdown: true, ..LinearOutcome::default() };
        if !reference.is_finite() {
            return Ok(broken);
        }
        if reference == 0.0 {
            return Ok(LinearOutcome { converged: true, ..LinearOutcome::default() });
        }
        self.analyse(matrix, others)?;
        let Some(analysis) = &mut self.analysis else { return Ok(broken) };
        fill((matrix, others), filters, analysis, &mut self.values);
        if analysis.factorisation.factorise(&self.values).is_err() {
            return Ok(broken);
        }
        self.change.clear();
        self.change.extend(residual.iter().flatten());
        analysis.factorisation.solve_in_place(&mut self.change);
        let answer: Vec<[f64; 3]> = start
            .iter()
            .zip(self.change.chunks_exact(3))
            .map(|(start, change)| std::array::from_fn(|axis| start[axis] + change[axis]))
            .collect();
        let left =
            norm(&self::residual((matrix, others), filters, &right_side, &answer)) / reference;
        if !left.is_finite() {
            return Ok(broken);
        }
        for (i, answer) in answer.iter().enumerate() {
            solution.set(i, answer.map(T::from_f64));
        }
        let tolerance = if T::EPSILON.to_f64() > 1e-10 { 1e-4 } else { 1e-10 };
        Ok(LinearOutcome {
            iterations: 1,
            residual: left,
            converged: left <= tolerance,
            ..LinearOutcome::default()
        })
    }

    /// Analyses the pattern anew if there are contacts that it does not have.
    fn analyse<T: Real>(&mut self, matrix: &BlockMatrix<T>, others: &[FullBlock<T>]) -> Result<()> {
        let pairs = matrix.pairs().iter().map(|pair| pair.particles);
        let mut contacts: Vec<[u32; 2]> =
            pairs.chain(others.iter().map(|&(i, j, _)| [i, j])).collect();
        contacts.retain(|pair| self.springs.binary_search(pair).is_err());
        contacts.sort_unstable();
        contacts.dedup();
        let is_known =
            |known: &[[u32; 2]]| contacts.iter().all(|pair| known.binary_search(pair).is_ok());
        if self.analysis.as_ref().is_some_and(|analysis| is_known(&analysis.contacts)) {
            return Ok(());
        }
        let pairs = [&*self.springs, &contacts].concat();
        let neighbourhood = Neighbourhood::new(self.positions.len(), &pairs);
        let pieces = neighbourhood.pieces();
        let order: Vec<usize> = nested_dissection(&self.positions, &neighbourhood, &pieces)
            .into_iter()
            .flat_map(|particle| (0..3).map(move |axis| 3 * particle as usize + axis))
            .collect();
        let pattern = LowerPattern::of_blocks(&neighbourhood, 3);
        let factorisation = SparseCholesky::new(pattern, Some(&order))?;
        self.analysis = Some(Analysis { contacts, neighbourhood, factorisation });
        Ok(())
    }
}

/// S A S + tr(D)/3 (I - S), in the order of the pattern.
fn fill<T: Real>(
    (matrix, others): (&BlockMatrix<T>, &[FullBlock<T>]),
    filters: &ParticleFilters<T>,
    analysis: &Analysis,
    values: &mut Vec<f64>,
) {
    let pattern = analysis.factorisation.pattern();
    values.clear();
    values.resize(pattern.rows.len(), 0.0);
    let mut add = |i: usize, j: usize, rows: [[T; 3]; 3]| {
        let after = analysis.neighbourhood.after(i);
        let Ok(place) = after.binary_search(&(j as u32)) else { return };
        // Entry (row of j, column of i) is that of row i and column j, transposed.
        for (column, entries) in rows.iter().enumerate() {
            let start = pattern.offsets[3 * i + column] + (3 - column) + 3 * place;
            for (value, entry) in values[start..start + 3].iter_mut().zip(entries) {
                *value += entry.to_f64();
            }
        }
    };
    for i in 0..matrix.count() {
        let (columns, blocks) = matrix.row(i);
        for (&j, &block) in columns.iter().zip(blocks) {
            add(i, j as usize, filters.block(i, j as usize, block));
        }
    }
    for pair in matrix.pairs() {
        let [i, j] = pair.particles.map(|particle| particle as usize);
        add(i, j, filters.block(i, j, pair.block));
    }
    for &(i, j, block) in others {
        let [i, j] = [i as usize, j as usize];
        add(i, j, filters.full(i, j, block));
    }
    for (i, block) in matrix.diagonal.iter().enumerate() {
        let mut block = block.map(T::to_f64);
        if let Some(filter) = filters.get(i) {
            // A third of the trace of the block, which is what stays of `restrict` for S = 0.
            let filter = filter.map(T::to_f64);
            let trace = block[0] + block[1] + block[2];
            block = restrict(&block, &filter);
            for axis in 0..3 {
                block[axis] -= 2.0 / 3.0 * trace * (1.0 - filter[axis]);
                block[3 + axis] += 2.0 / 3.0 * trace * filter[3 + axis];
            }
        }
        let rows = super::particle_filters::rows(&block);
        for (column, entries) in rows.iter().enumerate() {
            let start = pattern.offsets[3 * i + column];
            values[start..start + 3 - column].copy_from_slice(&entries[column..]);
        }
    }
}

/// S (b - A y) in double precision.
fn residual<T: Real>(
    (matrix, others): (&BlockMatrix<T>, &[FullBlock<T>]),
    filters: &ParticleFilters<T>,
    right_side: &[[f64; 3]],
    solution: &[[f64; 3]],
) -> Vec<[f64; 3]> {
    let mut residual = right_side.to_vec();
    let mut subtract = |i: usize, block: &Symmetric<T>, j: usize| {
        let term = times(&block.map(T::to_f64), solution[j]);
        for axis in 0..3 {
            residual[i][axis] -= term[axis];
        }
    };
    for i in 0..matrix.count() {
        subtract(i, &matrix.diagonal[i], i);
        let (columns, blocks) = matrix.row(i);
        for (&j, block) in columns.iter().zip(blocks) {
            subtract(i, block, j as usize);
            subtract(j as usize, block, i);
        }
    }
    for pair in matrix.pairs() {
        let [i, j] = pair.particles.map(|particle| particle as usize);
        subtract(i, &pair.block, j);
        subtract(j, &pair.block, i);
    }
    for &(i, j, block) in others {
        let [i, j] = [i as usize, j as usize];
        for row in 0..3 {
            for column in 0..3 {
                let entry = block[row][column].to_f64();
                residual[i][row] -= entry * solution[j][column];
                residual[j][column] -= entry * solution[i][row];
            }
        }
    }
    for (particle, filter) in filters.iter() {
        let entry = &mut residual[*particle as usize];
        *entry = times(&filter.map(T::to_f64), *entry);
    }
    residual
}

fn norm(vectors: &[[f64; 3]]) -> f64 {
    vectors.iter().flatten().map(|component| component * component).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::block_matrix::tests::{Numbers, dense, random_matrix, random_pairs};
    use super::*;
    use crate::implicit::block_matrix::Pair;
    use faer::{Mat, Side, prelude::Solve};

    /// A line of particles, so that positions are those of a cloth.
    fn positions(count: usize) -> Vec<[f64; 3]> {
        (0..count).map(|i| [i as f64, 0.1 * (i % 3) as f64, 0.0]).collect()
    }

    /// S as full matrix.
    fn filter_of(particle: usize, filters: &ParticleFilters<f64>) -> [[f64; 3]; 3] {
        let identity = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        super::super::particle_filters::rows(filters.get(particle).unwrap_or(&identity))
    }

    /// y = z + x with (S A S + I - S) x = S (b - A z), dense, by faer.
    fn expected(
        matrix: &BlockMatrix<f64>,
        filters: &ParticleFilters<f64>,
        right_side: &VectorField<f64>,
        start: &VectorField<f64>,
    ) -> Vec<f64> {
        let size = 3 * matrix.count();
        let all = dense(matrix);
        let a = Mat::from_fn(size, size, |i, j| all[i][j]);
        let s = Mat::from_fn(size, size, |i, j| {
            if i / 3 == j / 3 { filter_of(i / 3, filters)[i % 3][j % 3] } else { 0.0 }
        });
        let column =
            |field: &VectorField<f64>| Mat::from_fn(size, 1, |i, _| field.get(i / 3)[i % 3]);
        let (b, z) = (column(right_side), column(start));
        let identity = Mat::<f64>::identity(size, size);
        let system = &s * &a * &s + &identity - &s;
        let change = system.llt(Side::Lower).unwrap().solve(&s * (b - &a * &z));
        (0..size).map(|i| z[(i, 0)] + change[(i, 0)]).collect()
    }

    /// Every fifth particle held, every seventh constrained along a direction, every eleventh along
    /// all but one.
    fn filters(count: usize, numbers: &mut Numbers) -> ParticleFilters<f64> {
        let mut filters = ParticleFilters::new(count);
        for i in 0..count {
            let [x, y, z] = numbers.vector();
            let square = x * x + y * y + z * z;
            let along = [x * x, y * y, z * z, x * y, x * z, y * z].map(|entry| entry / square);
            let [a, b, c, d, e, f] = along;
            if i % 5 == 4 {
                filters.set(i, [0.0; 6]);
            } else if i % 7 == 1 {
                filters.set(i, [1.0 - a, 1.0 - b, 1.0 - c, -d, -e, -f]);
            } else if i % 11 == 2 {
                filters.set(i, along);
            }
        }
        filters
    }

    #[test]
    fn the_answer_is_that_of_a_dense_factorisation() {
        let mut numbers = Numbers::new(9);
        for count in [1, 2, 13, 80] {
            let springs = random_pairs(count, 3 * count, &mut numbers);
            let mut solver = DirectSolver::new(&positions(count), springs.clone());
            for contacts in
                [0, count / 3, count / 2, 0].map(|c| random_pairs(count, c, &mut numbers))
            {
                let matrix = random_matrix::<f64>(count, &springs, &contacts, &mut numbers);
                let filters = filters(count, &mut numbers);
                let right_side = numbers.field(count);
                // z lies in the constrained directions.
                let mut solution = numbers.field(count);
                for i in 0..count {
                    let (s, z) = (filter_of(i, &filters), solution.get(i));
                    let free = s.map(|row| row[0] * z[0] + row[1] * z[1] + row[2] * z[2]);
                    solution.set(i, std::array::from_fn(|k| z[k] - free[k]));
                }
                let expected = expected(&matrix, &filters, &right_side, &solution);
                let outcome =
                    solver.solve((&matrix, &[]), &filters, &right_side, &mut solution).unwrap();
                assert!(!outcome.breakdown && outcome.converged, "{outcome:?}");
                for (i, expected) in expected.iter().enumerate() {
                    assert!((solution.get(i / 3)[i % 3] - expected).abs() < 1e-11, "{count}: {i}");
                }
            }
        }
    }

    #[test]
    fn single_precision_is_solved_in_double() {
        let mut numbers = Numbers::new(21);
        let springs = random_pairs(50, 200, &mut numbers);
        let matrix = random_matrix::<f32>(50, &springs, &[], &mut numbers);
        let mut solver = DirectSolver::new(&positions(50), springs);
        let right_side = numbers.field(50);
        let mut solution = VectorField::new(50, 0);
        let filters = ParticleFilters::new(50);
        let outcome = solver.solve((&matrix, &[]), &filters, &right_side, &mut solution).unwrap();
        assert!(outcome.converged && outcome.residual < 1e-12, "{outcome:?}");
        assert_eq!(outcome.iterations, 1);
    }

    #[test]
    fn the_pattern_is_analysed_again_only_for_new_contacts() {
        let springs = vec![[0, 1], [1, 2], [2, 3]];
        let mut solver = DirectSolver::new(&positions(4), springs.clone());
        let mut matrix = BlockMatrix::<f64>::new(4, &springs);
        let mut contacts = |pairs: &[[u32; 2]]| {
            let block = [0.0; 6];
            let pairs: Vec<_> = pairs.iter().map(|&particles| Pair { particles, block }).collect();
            matrix.set_pairs(&pairs);
            solver.analyse(&matrix, &[]).unwrap();
            solver.analysis.as_ref().unwrap().contacts.clone()
        };
        assert!(contacts(&[]).is_empty());
        assert!(contacts(&[[1, 2]]).is_empty(), "a spring has that place already");
        assert_eq!(contacts(&[[0, 2], [1, 3]]), [[0, 2], [1, 3]]);
        assert_eq!(contacts(&[[1, 3]]), [[0, 2], [1, 3]], "still there");
        assert_eq!(contacts(&[[0, 3]]), [[0, 3]]);
    }

    #[test]
    fn what_cannot_be_factorised_breaks_down_and_leaves_the_solution() {
        let springs = vec![[0, 1], [1, 2]];
        let mut numbers = Numbers::new(5);
        let filters = ParticleFilters::new(3);
        let right_side = numbers.field(3);
        for bad in [-2.0, f64::NAN, f64::INFINITY, 0.0] {
            let mut matrix = random_matrix::<f64>(3, &springs, &[], &mut numbers);
            matrix.diagonal[1] = [bad, bad, bad, 0.0, 0.0, 0.0];
            let mut solver = DirectSolver::new(&positions(3), springs.clone());
            let mut solution = VectorField::new(3, 0);
            let outcome =
                solver.solve((&matrix, &[]), &filters, &right_side, &mut solution).unwrap();
            assert!(outcome.breakdown && !outcome.converged, "{bad}: {outcome:?}");
            assert!((0..3).all(|i| solution.get(i) == [0.0; 3]), "{bad}");
        }
        // Nothing to solve: every particle held.
        let matrix = random_matrix::<f64>(3, &springs, &[], &mut numbers);
        let mut held = ParticleFilters::new(3);
        (0..3).for_each(|i| held.set(i, [0.0; 6]));
        let mut solver = DirectSolver::new(&positions(3), springs);
        let mut solution = numbers.field(3);
        let z: [_; 3] = std::array::from_fn(|i| solution.get(i));
        let outcome = solver.solve((&matrix, &[]), &held, &right_side, &mut solution).unwrap();
        assert!(outcome.converged && outcome.iterations == 0, "{outcome:?}");
        assert!((0..3).all(|i| solution.get(i) == z[i]));
    }
}
