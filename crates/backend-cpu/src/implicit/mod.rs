//! NUMERICS §5: the linear system of the implicit step on the CPU.

mod conjugate_gradient;
mod constraint;
mod constraints;
mod contact_linearise;
mod filter;
mod implicit_assemble;
mod matrix;
mod matrix_apply;
mod preconditioner;
mod spring_factors;
mod spring_linearise;
mod system;
mod vector_operations;
mod vectors;

pub(crate) use system::{ImplicitSystem, Surroundings};
