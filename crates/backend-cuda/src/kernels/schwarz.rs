//! The preconditioner `schwarz`: the host builds it from a copy of the matrix, the device applies it.

use cloth_core::{
    LinearOutcome, LinearVector, Preconditioner, Result,
    schwarz::{Arch, FREE},
};

use super::{CudaKernels, implicit::unsupported};
use crate::{layout::CudaReal, queue::argument, schwarz::SchwarzMemory, solver_form::SolverForm};

impl<T: CudaReal> CudaKernels<T> {
    /// `preconditioner_build` of `schwarz`: anew, for other constraints, or not at all.
    pub(super) fn schwarz_build(&mut self) -> Result<()> {
        self.settle()?;
        self.linear()?;
        let Some(linear) = &mut self.linear else { unreachable!("it was just made") };
        linear.preconditioner = Preconditioner::Schwarz;
        let mut memory = match linear.schwarz.take() {
            Some(memory) => memory,
            None => Box::new(SchwarzMemory::new(&self.memory.queue, &self.model)?),
        };
        let length = linear.data.length.to_f64();
        let has_constraints = linear.data.has_constraints != 0;
        let built = self.schwarz_update(&mut memory, length, has_constraints);
        if let Some(linear) = &mut self.linear {
            linear.data.schwarz = memory.address();
            linear.schwarz = Some(memory);
        }
        built
    }

    fn schwarz_update(
        &mut self,
        memory: &mut SchwarzMemory<T>,
        length: f64,
        has_constraints: bool,
    ) -> Result<()> {
        let is_new = memory.reuse.wants_build(length);
        if !is_new {
            // Particles are held by command alone otherwise, which a frame begins with.
            if !has_constraints {
                return Ok(());
            }
            let filters = self.filters_read()?;
            let packed = |particle: u32| {
                filters[particle as usize]
                    .map_or(FREE, |filter| filter.map(|entry| entry.to_f64() as f32))
            };
            if !memory.schwarz.is_outdated(packed) {
                return Ok(());
            }
        }
        let Some(copy) = self.matrix_copy()? else { return Ok(()) };
        self.stage("preconditioner_build", |kernels| {
            if is_new {
                memory.schwarz.build(&copy, Arch::new());
            } else {
                memory.schwarz.update(&copy, Arch::new());
            }
            memory.upload(&kernels.memory.queue)
        })
    }

    /// `preconditioner_apply` of `schwarz`.
    pub(super) fn schwarz_apply(&mut self, from: LinearVector, to: LinearVector) -> Result<()> {
        self.settle()?;
        let name = "preconditioner_apply_schwarz";
        let Some(linear) = &mut self.linear else { return unsupported("a matrix out of nothing") };
        let launch = SolverForm::choose(name, &mut self.memory, linear, false)?;
        self.memory.solver_barrier_prepare(launch.blocks)?;
        let (from, to) = (from as u32, to as u32);
        self.stage("preconditioner_apply", |kernels| {
            let module = kernels.memory.solver.module();
            kernels.linear_start((module, name), launch, &[argument(&from), argument(&to)])
        })
    }

    /// Another frame, or another state: nothing of before counts.
    pub(super) fn schwarz_forget(&mut self) {
        if let Some(schwarz) = self.linear.as_mut().and_then(|linear| linear.schwarz.as_mut()) {
            schwarz.reuse.forget();
        }
    }

    /// Notes the iterations of a solve.
    pub(super) fn schwarz_solved(&mut self, outcome: &LinearOutcome) {
        let Some(linear) = &mut self.linear else { return };
        let is_schwarz = linear.is_schwarz();
        if let Some(schwarz) = &mut linear.schwarz {
            if is_schwarz {
                schwarz.reuse.solved(outcome.iterations);
            } else if outcome.restarted {
                schwarz.reuse.forget();
            }
        }
    }
}
