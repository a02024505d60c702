//! Cloth simulation: from a scene to its frames.
//!
//! ```
//! use cloth::{Simulation, backend_create, scene::{CompileOptions, Scene}};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene = Scene::builtin("drape")?;
//! # if let cloth::scene::SceneGeometry::Grid(grid) = &mut scene.cloths[0].geometry {
//! #     (grid.columns, grid.rows) = (21, 21);
//! # }
//! scene.simulation.frames = 2;
//! let compiled = scene.compile(&CompileOptions::default())?;
//! let backend = backend_create("cpu", None)?;
//! let mut simulation = Simulation::new(compiled, backend.as_ref())?;
//! while !simulation.is_finished() {
//!     simulation.step()?;
//!     let lowest = simulation.state()?.positions.iter().map(|x| x[2]).fold(f64::INFINITY, f64::min);
//!     println!("frame {}: lowest point at {lowest:.3} m", simulation.frame());
//! }
//! assert_eq!(simulation.state()?.time, 2.0 / 30.0);
//! # Ok(())
//! # }
//! ```
//!
//! - [`scene`] reads scene files and compiles them.
//! - [`backends()`] lists what can compute, [`backend_create`] makes one of them, [`backend_choose`] the
//!   fastest one that a scene can use.
//! - [`Simulation`] runs a compiled scene frame by frame; [`Checkpoint`] saves where it is. [`ModelSimulation`] runs a
//!   [`Model`] that code has built of [`Cloth`]s.
//! - [`io`] reads meshes, writes frames and renders pictures; [`topology`] and [`picture_style`]
//!   give it what it needs to know of a scene.
//! - [`SceneAudit`] counts triangles that intersect, exactly, in any state or frame.
//! - The contract of the engine itself, `cloth_core`, is here as a whole: [`Model`], [`Backend`],
//!   [`Solver`], [`State`], [`Control`], [`StepReport`], [`Error`].
//!
//! All quantities are in SI units, coordinates are right handed with z up.
//!
//! # Features
//!
//! One for each backend: `cpu` and `reference` (default), `cuda`, `wgpu`. `scene` (default) brings scene files, [`Simulation`], checkpoints,
//! and with them `io` (meshes, frames, pictures) and `rigid` (rigid bodies). Without it there is the engine alone, which
//! [`ModelSimulation`] drives: what a game needs.

mod backends;
#[cfg(feature = "scene")]
mod checkpoint;
#[cfg(feature = "scene")]
mod dust;
mod model_simulation;
#[cfg(feature = "scene")]
mod output;
#[cfg(feature = "scene")]
mod pose_log;
#[cfg(feature = "scene")]
mod rigid_exchange;
#[cfg(feature = "scene")]
mod rigid_holds;
#[cfg(feature = "scene")]
mod scene_audit;
#[cfg(feature = "scene")]
mod simulation;
#[cfg(feature = "scene")]
mod staged;

/// How the engine is built.
pub mod architecture {
    #![doc = include_str!("../ARCHITECTURE.md")]
}

/// How the engine is extended.
pub mod extending {
    #![doc = include_str!("../EXTENDING.md")]
}

pub use backends::{
    AUTO, BackendChoice, BackendError, BackendOptions, BackendOutcome, backend_choose,
    backend_create, backend_open, backends, backends_absent, backends_missing,
};
#[cfg(feature = "scene")]
pub use checkpoint::{CHECKPOINT_VERSION, Checkpoint, CheckpointError};
/// Exact counts of triangles that intersect.
#[cfg(feature = "scene")]
pub use cloth_audit as audit;
/// NVIDIA backend, and its options.
#[cfg(feature = "cuda")]
pub use cloth_backend_cuda as cuda;
/// The plain loops that all backends are held against.
#[cfg(feature = "reference")]
pub use cloth_backend_reference as reference;
/// GPU backend: adapters, and solvers that lend their buffers to a renderer.
#[cfg(feature = "wgpu")]
pub use cloth_backend_wgpu as wgpu;
pub use cloth_core::*;
/// Meshes in, frames and pictures out.
#[cfg(feature = "io")]
pub use cloth_io as io;
/// Rigid bodies.
#[cfg(feature = "rigid")]
pub use cloth_rigid as rigid;
/// Scene descriptions.
#[cfg(feature = "scene")]
pub use cloth_scene as scene;
pub use model_simulation::ModelSimulation;
#[cfg(feature = "scene")]
pub use output::{
    cloth_lines, collider_poses, frame_solids, picture_shapes, picture_style, picture_style_moving,
    topology,
};
#[cfg(feature = "scene")]
pub use pose_log::{PoseLog, PoseLogError, pose_line};
#[cfg(feature = "scene")]
pub use rigid_exchange::RigidExchange;
#[cfg(feature = "scene")]
pub use scene_audit::{FoldedBody, SceneAudit};
#[cfg(feature = "scene")]
pub use simulation::{SeamReport, Simulation};
#[cfg(feature = "scene")]
pub use staged::StagedSolver;
