//! The solver of a scene in progress.

use std::sync::Arc;

use cloth::{
    AUTO, Error, Solver, StagedSolver, State, backend_create, scene::CompiledScene,
    wgpu::WgpuSolver,
};

use crate::{Gpu, ViewerError};

/// A solver, which may lend its buffers.
pub(super) enum EngineSolver {
    /// On the device that draws.
    Shared(Box<WgpuSolver>),
    /// Anywhere else, and wherever what is simulated changes from frame to frame.
    Other(Box<StagedSolver>),
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
        let model = &scene.model;
        let is_one =
            model.seams().is_empty() && model.tears().is_empty() && scene.phases.is_empty();
        let solver = match backend {
            "wgpu" if is_one => {
                let solver = gpu.backend().create_wgpu_solver(Arc::clone(model), &scene.config)?;
                return Ok(Self::Shared(Box::new(solver)));
            }
            "wgpu" => StagedSolver::new(scene.clone(), gpu.backend())?,
            other => StagedSolver::new(scene.clone(), backend_create(other, None)?.as_ref())?,
        };
        Ok(Self::Other(Box::new(solver)))
    }

    /// Makes it ready for a frame of the scene.
    pub(super) fn begin(&mut self, frame: u64) -> Result<(), Error> {
        match self {
            Self::Shared(_) => Ok(()),
            Self::Other(solver) => solver.begin(frame).map(|_| ()),
        }
    }

    /// Stitches that are broken and edges that are torn.
    pub(super) fn gone(&self) -> [Vec<u32>; 2] {
        match self {
            Self::Shared(_) => [Vec::new(), Vec::new()],
            Self::Other(solver) => solver.gone(),
        }
    }

    /// Goes on from the state of a frame in which these stitches are broken and these edges torn.
    pub(super) fn restore(
        &mut self,
        (frame, state): (u64, &State),
        gone: &[Vec<u32>; 2],
    ) -> Result<(), Error> {
        match self {
            Self::Shared(solver) => solver.upload(state),
            Self::Other(solver) => solver.restore((frame, state), gone),
        }
    }

    pub(super) fn get(&mut self) -> &mut dyn Solver {
        match self {
            Self::Shared(solver) => solver.as_mut(),
            Self::Other(solver) => solver.as_mut(),
        }
    }
}
