//! The linear system of the implicit integrators: its memory, what is asked of a solver, and how much of a
//! solve is recorded ahead.
//!
//! The device decides when an iteration has converged; the host does not ask. It records a number of
//! iterations that earlier frames make likely, and what lies beyond the last one needed does nothing. If
//! the number was too small the frame is done again with more. As the iterations that are done do not
//! depend on how many were recorded, neither does the result.

mod policy;
mod request;

pub(crate) use policy::SolvePolicy;
pub(crate) use request::{SolveRequest, call_of, linear_check, matrix_check, preconditioner_check};

use cloth_core::LinearVector;

/// Number of a vector in the buffer of all (`shared/vectors.wgsl`).
pub(crate) const fn vector_number(vector: LinearVector) -> u32 {
    match vector {
        LinearVector::Solution => 0,
        LinearVector::RightSide => 1,
        LinearVector::Residual => 2,
        LinearVector::Preconditioned => 3,
        LinearVector::Image => 4,
        LinearVector::Direction => 5,
        LinearVector::DirectionImage => 6,
    }
}

/// Vectors of the linear system.
pub(crate) const VECTOR_COUNT: u64 = LinearVector::ALL.len() as u64;
/// Vectors of which there are two copies where an iteration is one kernel.
pub(crate) const VECTOR_COPIES: u64 = 3;
