//! Contact of triangles on the GPU against the CPU: its stages, and cloth that is dropped, shot, laid, left on a slope, on planes and on bodies.

mod bits;
mod bodies;
mod pairs;
mod pinched;
mod planes;
mod rig;
mod scenes;
mod stages;
mod stretch;
