//! One check for each stage and each property of whole simulations.
//!
//! A check answers with a [`Verdict`](crate::Verdict), it does not panic: the tests want `Ok` from
//! every backend, the negative controls want an `Err` from a wrong one.

mod bits_of_stages;
mod contact_pairs;
mod control_forces;
mod forces;
mod frames;
mod fused;
mod implicit;
mod invariants;
mod motion;
mod outputs;
mod patch_frames;
mod reproducibility;
mod scenario;
mod semi_implicit;
mod trajectory;

pub use bits_of_stages::{bits_of_explicit_stages, bits_of_implicit_stages};
pub use contact_pairs::{
    contact_candidates, contact_candidates_after_moves, contact_candidates_of_approaching_sheets,
    contact_candidates_reused,
};
pub use control_forces::{control_forces, control_forces_frames, control_forces_trajectory};
pub use forces::{
    aerodynamic_forces, bending_forces, contact_forces, field_forces, membrane_forces,
    procedural_forces, spring_forces,
};
pub use frames::{frames, patch_frames_near, patch_frames_within, scenario_frames};
pub use fused::explicit_substep;
pub use implicit::{
    collider_constraints, conjugate_gradient, constraint_filter, constraint_impulses,
    constraint_project, constraint_release, control_forces_assemble, implicit_assemble,
    implicit_frame, implicit_trajectory, jacobi, linear_solution, matrix_apply,
    matrix_apply_to_a_translation, position_advance, position_from_kept, preconditioner_apply,
    preconditioner_is_symmetric, schwarz_of_many_groups, state_keep, state_restore, vector_combine,
    vector_dot, vector_fill, velocity_add,
};
pub use invariants::invariants;
pub use motion::{
    collider_impulses, collider_response, contact_impulses, integrate_explicit, strain_limit,
    stretch_limit,
};
pub use outputs::{measure, vertex_normals};
pub use patch_frames::{PatchFrames, patch_frames};
pub use reproducibility::{resumes_with_same_bits, same_bits};
pub use scenario::Scenario;
pub use semi_implicit::{semi_implicit_solve, solution_motion, torque_correct};
pub use trajectory::trajectory;
