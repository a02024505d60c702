//! The stages of triangles of fabric: a kernel over triangles, whose results the gather of another one sums.

use cloth_core::{NewtonStart, Result, stepper::Substep};

use super::CudaKernels;
use crate::{
    layout::{BLOCK, CudaReal},
    measure::{FABRIC_FIGURES, FabricSums},
    queue::{Buffer, Launch, argument},
};

impl<T: CudaReal> CudaKernels<T> {
    /// Triangles of fabric.
    fn element_count(&self) -> usize {
        self.memory.data.element_count as usize
    }

    /// Forces of all triangles, added to f: `module` has these kernels over so many items each, and `gather` over the particles.
    pub(super) fn fabric_forces(
        &mut self,
        module: &'static str,
        parts: &[(&'static str, u32)],
        gather: &'static str,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.settle()?;
        let particles = Launch::over(self.count());
        self.stage(module, |kernels| {
            for &(part, items) in parts.iter().filter(|(_, items)| *items > 0) {
                kernels.start((module, part), Launch::over(items as usize), &[])?;
            }
            kernels.start((module, gather), particles, &[])
        })
    }

    /// Tangents and impulses of all triangles.
    pub(super) fn fabric_linearise(
        &mut self,
        stage: &'static str,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.settle()?;
        self.linear()?.length_set(T::from_f64(substep.length));
        let from_start = u32::from(start == NewtonStart::StepStart);
        let launch = Launch::over(self.element_count());
        self.stage(stage, |kernels| {
            kernels.linear_start((stage, stage), launch, &[argument(&from_start)])
        })
    }

    /// What they add to the matrix and the right-hand side.
    pub(super) fn fabric_assemble(&mut self) -> Result<()> {
        let count = self.count();
        let Some(elements) = &self.linear()?.elements else { return Ok(()) };
        let launch = Launch::over(elements.assemble_items(count));
        self.stage("implicit_assemble", |kernels| {
            kernels.linear_start(("implicit_assemble", "implicit_assemble_fabric"), launch, &[])
        })
    }

    /// Energies and stretches of the triangles.
    pub(super) fn fabric_measure(&mut self) -> Result<FabricSums> {
        let count = self.element_count();
        let blocks = count.div_ceil(BLOCK);
        if blocks == 0 {
            return Ok(FabricSums::new(0, &[]));
        }
        let out = Buffer::<f64>::zeros(&self.memory.queue, FABRIC_FIGURES * blocks)?;
        let launch =
            Launch { blocks: blocks as u32, threads: BLOCK as u32, shared: 0, cooperative: false };
        let address = out.address();
        self.stage("measure", |kernels| {
            kernels.start(("measure", "measure_fabric"), launch, &[argument(&address)])
        })?;
        let mut partials = Vec::new();
        out.read(&self.memory.queue, &mut partials)?;
        Ok(FabricSums::new(count, &partials))
    }
}
