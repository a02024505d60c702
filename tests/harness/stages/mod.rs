//! Every stage of NUMERICS.md on tracked numbers: the functions of the reference backend, with a mark on each particle for
//! which rounding decides what happens.
//!
//! Those functions are written from the text, without looking at any other backend: no neighbour lists, no fusing. What is
//! here beside them looks at a result in another way than the backend finds it.

mod colliders;
mod contact;
mod explicit;
mod procedural;
mod semi_implicit;

use crate::tracked::Tracked;

pub use cloth_backend_reference::{
    ContactPairs, Linearisation, Surplus, aerodynamic_forces, angular_surplus, bending_forces,
    bending_linearise, collider_constraints, constraint_impulses, constraint_release,
    contact_candidates, contact_linearise, control_forces, control_forces_assemble, field_forces,
    implicit_assemble, integrate_explicit, measure, membrane_forces, membrane_linearise,
    preconditioner_apply, spring_forces, spring_linearise, spring_tension, strain_limit,
    stretch_limit, vertex_normals,
};
pub use colliders::collider_response;
pub use contact::{contact_forces, contact_impulses, contact_pairs};
pub use explicit::explicit_substep;
pub use procedural::{PROCEDURAL_COUNT, procedural_forces, procedural_source};
pub use semi_implicit::{pieces, semi_implicit_residual};

/// The state of all particles.
pub type Particles = cloth_backend_reference::Particles<Tracked>;
/// The constraint of one particle.
pub type Constraint = cloth_backend_reference::Constraint<Tracked>;
/// The constraints of all particles.
pub type Constraints = cloth_backend_reference::Constraints<Tracked>;
/// A y = b.
pub type LinearSystem = cloth_backend_reference::LinearSystem<Tracked>;
/// What a collider did: the sum of its impulses, and of their moments about the origin.
pub type TrackedImpulse = cloth_backend_reference::Impulse<Tracked>;

const ONE: Tracked = Tracked::exact(1.0);
