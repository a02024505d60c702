//! Contact of triangles: what it promises, counted by a test of intersection that shares no code with it.

#![expect(clippy::unwrap_used, reason = "a rig that fails is a test that fails")]

mod crossings;
mod layers;
mod rig;
