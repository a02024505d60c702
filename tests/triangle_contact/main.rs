//! Contact of triangles on the GPU against the CPU: its stages, and cloth that is dropped, shot, laid, left on a slope and on bodies.

mod bits;
mod bodies;
mod pairs;
mod pinched;
mod rig;
mod scenes;
mod stages;
mod stretch;
