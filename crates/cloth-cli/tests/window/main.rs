//! A real window on a virtual screen: keys and the pointer, as a hand would use them, and what they do
//! to the simulation and to the picture.

#![cfg(all(target_os = "linux", feature = "viewer"))]
#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

mod controls;
mod drop_source;
mod messages;
mod pictures;
mod screen;
mod session;
mod sources;
