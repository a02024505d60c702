//! Cloth of fabric: its shape at rest, and meshes as they come.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod folds;
mod irregular;
