//! What the tests of the engine share.
//!
//! - [`backends`]: the backends under test;
//! - [`models`]: generators of models and states;
//! - [`stages`]: every stage of NUMERICS.md once more, as plain loops, on numbers that carry a
//!   bound of their rounding error ([`tracked`]);
//! - [`checks`]: one check for each stage and property, which answers with a [`Verdict`], so that
//!   the negative controls can assert that a wrong backend is found out;
//! - [`perturbed`]: the wrong backends;
//! - [`scenes`]: built-in scenes cut down;
//! - [`linear`]: the linear solvers under test; [`dense`]: matrices to compare them with.

pub mod backends;
pub mod bits;
pub mod checks;
pub mod dense;
pub mod feature;
pub mod linear;
pub mod models;
pub mod perturbed;
pub mod random;
pub mod runner;
pub mod scenes;
pub mod stages;
pub mod tracked;
pub mod verdict;

pub use verdict::Verdict;
