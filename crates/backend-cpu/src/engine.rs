//! What puts the parts together: the backend makes solvers.

use std::sync::Arc;

use cloth_core::{
    Backend, BackendInfo, Kernels, Model, Precision, Result, Solver, SolverConfig,
    stepper::SteppedSolver,
};

use crate::{CpuBackend, fabric, kernels::CpuKernels, triangle_contact};

impl Backend for CpuBackend {
    fn info(&self) -> &BackendInfo {
        &self.info
    }

    fn share(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(self.clone()))
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        fabric::check(&model, config)?;
        triangle_contact::check(&model, config)?;
        let team = self.team_for(config)?;
        Ok(match config.precision {
            Precision::F32 => Box::new(SteppedSolver::new(CpuKernels::<f32>::new(
                model, config, team, self.arch,
            )?)?),
            Precision::F64 => Box::new(SteppedSolver::new(CpuKernels::<f64>::new(
                model, config, team, self.arch,
            )?)?),
        })
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        fabric::check(&model, config)?;
        triangle_contact::check(&model, config)?;
        let team = self.team_for(config)?;
        Ok(match config.precision {
            Precision::F32 => Box::new(CpuKernels::<f32>::new(model, config, team, self.arch)?),
            Precision::F64 => Box::new(CpuKernels::<f64>::new(model, config, team, self.arch)?),
        })
    }
}
