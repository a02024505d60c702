//! NUMERICS §5: the linear system of the implicit step and its constraints.

mod collider_constraints;
mod constraint_impulses;
mod constraint_release;
mod direct_solve;
mod implicit_assemble;
mod linearise;
mod preconditioner_apply;
mod schwarz;
mod touch;
mod vectors;

pub use collider_constraints::{Constraint, Constraints, collider_constraints};
pub use constraint_impulses::constraint_impulses;
pub use constraint_release::constraint_release;
pub(crate) use direct_solve::direct_solve;
pub use implicit_assemble::{
    ElementBlock, Elements, LinearSystem, Linearisation, implicit_assemble,
};
pub use linearise::{Term, contact_linearise, spring_linearise};
pub use preconditioner_apply::preconditioner_apply;
pub use schwarz::Schwarz;
pub use vectors::{vector_combine, vector_dot};
