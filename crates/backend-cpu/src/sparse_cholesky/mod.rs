//! Sparse Cholesky factorisation, and fast solves with the factor.
//!
//! faer factorises, in double precision. Its solves run on one thread; ours divide the tree of
//! supernodes among threads, take three right-hand sides at once, and may keep the factor in single
//! precision.

mod factorisation;
mod ordering;
mod panels;
mod pattern;
mod solve;
mod tile;
mod tree;

pub(crate) use factorisation::SparseCholesky;
pub(crate) use ordering::nested_dissection;
pub(crate) use panels::Panels;
pub(crate) use pattern::{LowerPattern, Neighbourhood};
pub(crate) use solve::SupernodalSolver;
pub(crate) use tile::tile_product;

/// Rows that are worked on together: the width of the widest vector registers, or two of them.
pub(crate) const TILE: usize = 16;
