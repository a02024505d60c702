//! NUMERICS §5: the linear system of the implicit step, and its constraints.

mod air;
mod constraints;
mod matrix;
mod preconditioner;
mod system;
mod touch;

pub use air::air_jacobians;
pub use constraints::{Constraint, Constraints, constraint_impulses};
pub use matrix::TrackedMatrix;
pub use preconditioner::preconditioner_apply;
pub use system::{LinearSystem, Term, contact_terms, spring_terms};
