//! Colliders as triangles in contact of triangles: nothing of them goes through cloth, on the processor and on the reference.

mod input;
mod passing;
mod rig;
mod same;
