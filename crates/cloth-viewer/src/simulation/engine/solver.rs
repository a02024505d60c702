//! The solver of a scene in progress.

use std::sync::Arc;

use cloth::{AUTO, Backend, Error, Solver, backend_create, scene::CompiledScene, wgpu::WgpuSolver};

use crate::{Gpu, ViewerError};

/// A solver, which may lend its buffers.
pub(super) enum EngineSolver {
    /// On the device that draws.
    Shared(Box<WgpuSolver>),
    /// Anywhere else.
    Other(Box<dyn Solver>),
}

impl EngineSolver {
    /// A solver of the backend with this name, and the name. `auto` is `wgpu` if that is a GPU and can
    /// run the scene.
    pub(super) fn choose(
        gpu: &Gpu,
        backend: &str,
        scene: &CompiledScene,
    ) -> Result<(Self, String), ViewerError> {
        if backend == AUTO {
            if !gpu.is_processor() {
                match Self::new(gpu, "wgpu", scene) {
                    Err(ViewerError::Simulation(
                        Error::Unsupported { .. }
                        | Error::LimitExceeded { .. }
                        | Error::OutOfMemory { .. },
                    )) => {}
                    outcome => return Ok((outcome?, "wgpu".into())),
                }
            }
            return Ok((Self::new(gpu, "cpu", scene)?, "cpu".into()));
        }
        Ok((Self::new(gpu, backend, scene)?, backend.to_owned()))
    }

    pub(super) fn new(
        gpu: &Gpu,
        backend: &str,
        scene: &CompiledScene,
    ) -> Result<Self, ViewerError> {
        if !scene.model.seams().is_empty() || !scene.phases.is_empty() {
            let feature = "seams and phases (`cloth run` does, whose frames can be viewed)".into();
            return Err(Error::Unsupported { backend: "viewer", feature }.into());
        }
        let model = Arc::clone(&scene.model);
        if backend == "wgpu" {
            let solver = gpu.backend().create_wgpu_solver(model, &scene.config)?;
            return Ok(Self::Shared(Box::new(solver)));
        }
        let backend: Box<dyn Backend> = backend_create(backend, None)?;
        Ok(Self::Other(backend.create_solver(model, &scene.config)?))
    }

    pub(super) fn get(&mut self) -> &mut dyn Solver {
        match self {
            Self::Shared(solver) => solver.as_mut(),
            Self::Other(solver) => solver.as_mut(),
        }
    }
}
