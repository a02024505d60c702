//! NUMERICS §6: backward Euler with a constant matrix. One module for each stage.

mod constant_matrix;
mod dense_inverse;
mod inertia;
mod semi_implicit_factorise;
mod semi_implicit_solve;
mod torque_correct;

pub(crate) use semi_implicit_factorise::SemiImplicit;
pub(crate) use semi_implicit_solve::RightSide;
pub(crate) use torque_correct::{FreePieces, TorqueTerms};
