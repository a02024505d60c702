//! Rigid bodies, and solids of any shape as colliders for cloth.
//!
//! [`RigidWorld`] moves bodies that collide with each other and with the colliders of a model
//! (through the library rapier), and that a [`RigidJoint`] may join. [`distance_grid`] samples the signed distance of a closed mesh
//! (through parry), the form in which every backend knows such a solid; [`distance_grid_sequence`] those of a mesh
//! that moves.
//!
//! Cloth and bodies meet in short parts of each frame: the bodies move first, the cloth then feels them as
//! colliders on their way, and [`RigidWorld::apply`] gives them the impulses that the cloth took, reversed.
//! What one side gains the other loses, so that momentum is conserved to rounding, and with the implicit
//! integrator to what its linear solver leaves. A body feels the cloth
//! one part of a frame late, so that it must not be much lighter than the cloth that rests on it.
//!
//! Where cloth between a body and something else cannot make way, [`RigidWorld::stop`] takes back what the body has come nearer.

mod closest;
mod distance_grid;
mod error;
mod joint;
mod mesh;
mod motion;
mod shape;
mod snapshot;
mod stop;
mod world;

pub use closest::{ClosestPoint, ClosestPoints};
pub use distance_grid::{DistanceGridPlan, distance_grid, distance_grid_sequence};
pub use error::RigidError;
pub use joint::{RigidJoint, RigidJointKind};
pub use motion::RigidMotion;
pub use shape::{RigidBody, RigidShape};
pub use stop::Stop;
pub use world::RigidWorld;
