//! NUMERICS §5, `preconditioner_build` and `preconditioner_apply`: those that are a formula for each particle.

use super::Constraint;
use crate::{Matrix, Number, Vector};

/// S P^-1 r of one particle, with its block D of the matrix; `blocks` takes all of D, else its
/// diagonal.
#[must_use]
pub fn preconditioner_apply<N: Number>(
    diagonal: Matrix<N>,
    constraint: &Constraint<N>,
    blocks: bool,
    residual: Vector<N>,
    epsilon: f64,
) -> Vector<N> {
    if constraint.is_held() {
        return Vector::ZERO;
    }
    let filter = constraint.filter();
    let within = if constraint.is_free() {
        diagonal
    } else {
        let outside = Matrix::diagonal(N::ONE) + filter.negated();
        filter.product(diagonal).product(filter) + outside.scaled(diagonal.trace())
    };
    let preconditioned = if blocks {
        let safety = N::exact(4.0 * epsilon) * within.trace();
        (within + Matrix::diagonal(safety)).solve(residual)
    } else {
        Vector(std::array::from_fn(|k| residual.0[k] / within.0[k].0[k]))
    };
    constraint.filtered(preconditioned)
}
