//! The stages of the implicit integrator (NUMERICS §5).

mod constraints;
mod prepared;
mod schwarz;
mod solvers;
mod state;
mod system;
mod vectors;

pub use constraints::{
    collider_constraints, constraint_filter, constraint_impulses, constraint_project,
    constraint_release,
};
pub use schwarz::schwarz_of_many_groups;
pub use solvers::{
    conjugate_gradient, implicit_frame, implicit_trajectory, jacobi, linear_solution,
};
pub use state::{position_advance, position_from_kept, state_keep, state_restore, velocity_add};
pub use system::{
    control_forces_assemble, implicit_assemble, matrix_apply, matrix_apply_to_a_translation,
};
pub use vectors::{
    preconditioner_apply, preconditioner_is_symmetric, vector_combine, vector_dot, vector_fill,
};
