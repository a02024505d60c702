//! Generated models and states.
//!
//! A [`Description`] says in a few readable words what a case is made of and holds the seed of all
//! its random numbers; it is what proptest simplifies and prints. [`Description::case`] makes the
//! model, the state and the frame from it.

mod case;
mod description;
mod forces;
mod mesh;
mod network;
mod pieces;
mod states;
mod surroundings;

pub use case::Case;
pub use description::{
    Contact, Deformation, Description, Piece, Place, description, description_of_fabric,
};
pub use forces::{RandomForces, forces};
pub use mesh::irregular_mesh;
pub use pieces::{grid_cloth, material};
pub use states::fold;
