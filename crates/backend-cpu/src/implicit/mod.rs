//! NUMERICS §5: the linear system of the implicit step on the CPU.

#[allow(dead_code, reason = "the linear system does not offer it yet")]
mod block_matrix;
mod conjugate_gradient;
mod constraint;
mod constraints;
mod contact_linearise;
#[allow(dead_code, reason = "the linear system does not offer it yet")]
mod direct;
mod filter;
mod implicit_assemble;
#[allow(dead_code, reason = "the linear system does not offer it yet")]
mod incomplete_cholesky;
mod matrix;
mod matrix_apply;
#[allow(dead_code, reason = "the linear system does not offer it yet")]
mod particle_filters;
mod preconditioner;
mod spring_factors;
mod spring_linearise;
mod system;
mod vector_operations;
mod vectors;

pub(crate) use system::{ImplicitSystem, Surroundings};
