//! Contact of triangles on the GPU against the CPU: its stages, and cloth that is dropped, shot, laid and left on a slope.

mod bits;
mod pairs;
mod rig;
mod scenes;
mod stages;
