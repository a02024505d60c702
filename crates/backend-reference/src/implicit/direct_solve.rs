//! NUMERICS §5, `direct_solve`.

use cloth_core::LinearOutcome;

use super::{Constraints, LinearSystem};
use crate::{Matrix, Vector, sparse_cholesky::SparseCholesky};

/// Relative residual within which a solve counts as converged.
const TOLERANCE: f64 = 1e-10;

/// Adds to z, which `solution` holds, what solves A y = b in the free directions: y = z + x with
/// (S A S + tr(D)/3 (I - S)) x = S (b - A z). Leaves it as it is if the matrix cannot be factorised.
pub(crate) fn direct_solve(
    system: &LinearSystem<f64>,
    constraints: &Constraints<f64>,
    solution: &mut [Vector<f64>],
) -> LinearOutcome {
    let broken =
        LinearOutcome { residual: f64::INFINITY, breakdown: true, ..LinearOutcome::default() };
    let residual = filtered_residual(system, constraints, solution);
    let reference = norm(&residual);
    if !reference.is_finite() {
        return broken;
    }
    if reference == 0.0 {
        return LinearOutcome { converged: true, ..LinearOutcome::default() };
    }
    let mut entries = Vec::new();
    for ([row, column], block) in system.blocks() {
        let block = filtered_block(constraints, [row, column], block);
        for (k, entry) in block.0.iter().flat_map(|row| row.0).enumerate() {
            entries.push((3 * row + k / 3, 3 * column + k % 3, entry));
        }
    }
    entries.retain(|(row, column, _)| row >= column);
    let Some(factors) = SparseCholesky::new(3 * solution.len(), &entries) else { return broken };
    let right_side: Vec<[f64; 1]> =
        residual.iter().flat_map(|vector| vector.0.map(|component| [component])).collect();
    let change = factors.solve(&right_side);
    let mut answer = solution.to_vec();
    for (answer, change) in answer.iter_mut().zip(change.chunks_exact(3)) {
        *answer += Vector([change[0][0], change[1][0], change[2][0]]);
    }
    let residual = norm(&filtered_residual(system, constraints, &answer)) / reference;
    if !residual.is_finite() {
        return broken;
    }
    solution.copy_from_slice(&answer);
    let converged = residual <= TOLERANCE;
    LinearOutcome { iterations: 1, residual, converged, ..LinearOutcome::default() }
}

/// A block of S A S + tr(D)/3 (I - S).
fn filtered_block(
    constraints: &Constraints<f64>,
    [row, column]: [usize; 2],
    block: Matrix<f64>,
) -> Matrix<f64> {
    let [left, right] = [row, column].map(|particle| constraints.0[particle].filter());
    let filtered = left.product(block).product(right);
    if row != column || constraints.0[row].is_free() {
        return filtered;
    }
    let outside = Matrix::diagonal(1.0) + left.negated();
    filtered + outside.scaled(block.trace() / 3.0)
}

/// S (b - A y).
fn filtered_residual(
    system: &LinearSystem<f64>,
    constraints: &Constraints<f64>,
    solution: &[Vector<f64>],
) -> Vec<Vector<f64>> {
    let image = system.apply(solution);
    let mut residual: Vec<_> =
        system.right_side.iter().zip(image).map(|(b, image)| *b - image).collect();
    constraints.filter(&mut residual);
    residual
}

fn norm(vectors: &[Vector<f64>]) -> f64 {
    vectors.iter().map(|vector| vector.dot(*vector)).sum::<f64>().sqrt()
}
