//! Tests that a textile laboratory makes, run on a backend and compared with what the numbers of the fabric, or theory, say.
//!
//! A cloth must be what its numbers say, however it is meshed: each [`Experiment`] runs on a regular, an alternating and an
//! irregular mesh, at two resolutions, and lists what was measured beside what is expected. What is expected is computed by
//! `theory`, which shares no code with the engine. Pieces come to rest in `statics`: the backend computes forces and tangents, in
//! its memory and precision, and a sparse factorisation on the host says where the next iterate lies.

mod experiments;
mod laboratory;
mod meshes;
mod outcome;
mod page;
mod statics;
mod table;
mod theory;

pub use experiments::{EXPERIMENTS, Experiment};
pub use laboratory::{Flaw, Laboratory, Thoroughness};
pub use meshes::MeshKind;
pub use outcome::{Curve, CurveStyle, Expected, Measurement, Outcome, Plot};
pub use page::page;
pub use table::table;
