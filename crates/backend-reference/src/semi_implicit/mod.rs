//! NUMERICS §6: backward Euler with a constant matrix.

mod semi_implicit_factorise;
mod semi_implicit_solve;
mod torque_correct;

pub(crate) use semi_implicit_factorise::{Factorisations, semi_implicit_factorise};
pub(crate) use semi_implicit_solve::semi_implicit_solve;
pub(crate) use torque_correct::torque_correct;
pub use torque_correct::{Surplus, angular_surplus};
