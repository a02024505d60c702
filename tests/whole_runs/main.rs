//! What whole runs promise: through the facade, on every backend that this machine has.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod builtin;
mod divergence;
mod report;
mod resume;
