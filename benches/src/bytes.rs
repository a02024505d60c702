//! Bytes that work cannot do without for each particle, if every number comes from memory once.

/// Of the state, in a substep of the explicit integrator: position, velocity, inverse mass and mass are read and written.
pub const STATE_BYTES: f64 = 64.0;

/// Of an iteration of the conjugate gradient method where particles have 24 neighbours: the factors of 12 springs, the vectors, the
/// diagonal of the matrix, the preconditioner.
pub const ITERATION_BYTES: f64 = 400.0;
