//! NUMERICS §5: the preconditioners that are a formula for each particle.

use super::{super::ONE, Constraint, TrackedMatrix};
use crate::tracked::{Tracked, TrackedVector};

/// S P^-1 r of one particle, with its block D of the matrix; `blocks` takes all of D, else its
/// diagonal.
#[must_use]
pub fn preconditioner_apply(
    diagonal: TrackedMatrix,
    constraint: &Constraint,
    blocks: bool,
    residual: TrackedVector,
    epsilon: f64,
) -> TrackedVector {
    if constraint.is_held() {
        return TrackedVector::ZERO;
    }
    let filter = constraint.filter();
    let within = if constraint.is_free() {
        diagonal
    } else {
        let outside = TrackedMatrix::diagonal(ONE) + filter.negated();
        filter.product(diagonal).product(filter) + outside.scaled(diagonal.trace())
    };
    let preconditioned = if blocks {
        let safety = Tracked::exact(4.0 * epsilon) * within.trace();
        (within + TrackedMatrix::diagonal(safety)).solve(residual)
    } else {
        TrackedVector(std::array::from_fn(|k| residual.0[k] / within.0[k].0[k]))
    };
    if constraint.is_free() { preconditioned } else { filter.apply(preconditioned) }
}
