//! The linear system of an implicit step: its memory, its kernels, and which settings there are.

use std::ffi::c_void;

use cloth_core::{
    Error, LinearOutcome, LinearSettings, LinearStart, LinearStop, LinearVector, MatrixForm,
    Preconditioner, Result, stepper::Substep,
};

use super::CudaKernels;
use crate::{
    fault::BACKEND,
    layout::CudaReal,
    linear::{self, LinearMemory, Outcome},
    queue::{Launch, argument},
};

pub(super) fn unsupported<R>(feature: impl Into<String>) -> Result<R> {
    Err(Error::Unsupported { backend: BACKEND, feature: feature.into() })
}

impl<T: CudaReal> CudaKernels<T> {
    /// The memory of the linear system, taken when it is first needed.
    pub(super) fn linear(&mut self) -> Result<&mut LinearMemory<T>> {
        if self.linear.is_none() {
            self.linear = Some(Box::new(LinearMemory::new(&self.memory, &self.model)?));
        }
        match &mut self.linear {
            Some(linear) => Ok(linear),
            None => unreachable!("it was just made"),
        }
    }

    /// Starts a kernel of the linear system.
    pub(super) fn linear_start(
        &mut self,
        name: (&'static str, &'static str),
        launch: Launch,
        more: &[*mut c_void],
    ) -> Result<()> {
        let data = self.linear()?.data;
        let mut arguments = vec![argument(&data)];
        arguments.extend_from_slice(more);
        self.start(name, launch, &arguments)
    }

    /// A stage that is one kernel over all particles.
    pub(super) fn linear_stage(
        &mut self,
        (module, name): (&'static str, &'static str),
        more: &[*mut c_void],
    ) -> Result<()> {
        self.settle()?;
        let launch = Launch::over(self.count());
        self.stage(name, |kernels| kernels.linear_start((module, name), launch, more))
    }

    /// A whole solve in one launch, by the kernel of this name, which is that of its module.
    pub(super) fn solve(
        &mut self,
        name: &'static str,
        settings: &LinearSettings,
        start: LinearStart,
    ) -> Result<(LinearOutcome, Outcome)> {
        self.settle()?;
        self.linear()?;
        let Some(linear) = &mut self.linear else { unreachable!("it was just made") };
        let by_energy = settings.stop == LinearStop::Energy;
        let launch = linear::choose((name, name), &self.memory, &mut self.cache, linear)?;
        self.memory.status.solver_barrier_prepare(&self.memory.queue, launch.blocks)?;
        let from_solution = u32::from(start == LinearStart::Solution);
        let energy = u32::from(by_energy);
        let arguments = [
            argument(&settings.tolerance),
            argument(&settings.iterations_max),
            argument(&from_solution),
            argument(&energy),
        ];
        self.stage(name, |kernels| kernels.linear_start((name, name), launch, &arguments))?;
        let outcome = self.outcome()?;
        let done = LinearOutcome {
            iterations: outcome.iterations,
            residual: outcome.residual,
            energy: (by_energy && !outcome.energy.is_nan()).then_some(outcome.energy),
            converged: outcome.converged != 0,
            breakdown: outcome.breakdown != 0,
            restarted: false,
        };
        Ok((done, outcome))
    }

    pub(super) fn outcome(&mut self) -> Result<Outcome> {
        let mut read = Vec::new();
        self.linear()?;
        if let Some(linear) = &self.linear {
            linear.outcome.read(&self.memory.queue, &mut read)?;
        }
        Ok(read[0])
    }

    pub(super) fn length_set(&mut self, substep: &Substep) -> Result<()> {
        self.linear()?.data.length = T::from_f64(substep.length);
        Ok(())
    }

    /// The matrix times a vector, whatever the form.
    pub(super) fn row_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        let (from, to) = (from as u32, to as u32);
        self.linear_stage(("matrix_apply", "matrix_apply"), &[argument(&from), argument(&to)])
    }

    pub(super) fn position_move(&mut self, length: f64, from_kept: u32) -> Result<()> {
        self.settle()?;
        let length = T::from_f64(length);
        let launch = Launch::over(self.count());
        self.stage("position_advance", |kernels| {
            let arguments = [argument(&length), argument(&from_kept)];
            kernels.start(("implicit_motion", "position_advance"), launch, &arguments)
        })
    }
}

pub(super) fn check_matrix(form: MatrixForm) -> Result<()> {
    match form {
        MatrixForm::MatrixFree => Ok(()),
        other => unsupported(format!("the matrix form {other}")),
    }
}

pub(super) fn check_preconditioner(preconditioner: Preconditioner) -> Result<bool> {
    match preconditioner {
        Preconditioner::Diagonal => Ok(false),
        // Auto is one of both in each solve.
        Preconditioner::Block | Preconditioner::Schwarz | Preconditioner::Auto => Ok(true),
        other => unsupported(format!("the preconditioner {other}")),
    }
}

/// Whether the settings ask for something that this backend has.
///
/// # Errors
/// `Unsupported` with what it has not.
pub(super) fn check_settings(settings: &LinearSettings) -> Result<()> {
    use cloth_core::LinearMethod::{ConjugateGradient, Jacobi};
    match settings.method {
        ConjugateGradient => check_preconditioner(settings.preconditioner).map(drop)?,
        Jacobi => {}
        other => return unsupported(format!("the linear solver {other}")),
    }
    check_matrix(settings.matrix)
}
