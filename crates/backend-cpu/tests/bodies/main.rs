//! Colliders as triangles in contact of triangles: nothing of them goes through cloth, on the processor and on the reference.

mod friction;
mod input;
mod passing;
mod rig;
mod same;
