//! NUMERICS §5: the linear system of the implicit step on the CPU.

mod assembled;
mod block_matrix;
mod conjugate_gradient;
mod constraint;
mod constraints;
mod contact_linearise;
mod contact_rows;
mod direct;
mod filter;
mod implicit_assemble;
mod incomplete_cholesky;
mod matrix;
mod matrix_apply;
mod particle_filters;
mod phased_iterations;
mod preconditioner;
mod schwarz_apply;
mod schwarz_rows;
mod spring_factors;
mod spring_linearise;
mod system;
mod vector_operations;
mod vectors;

pub(crate) use system::{ImplicitSystem, Surroundings};
