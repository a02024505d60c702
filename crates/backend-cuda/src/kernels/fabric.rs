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

    /// Forces of all triangles that stretch, added to f.
    pub(super) fn membranes_pull(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.settle()?;
        let (triangles, particles) = (self.element_count(), self.count());
        let stage = "membrane_forces";
        self.stage(stage, |kernels| {
            kernels.start((stage, stage), Launch::over(triangles), &[])?;
            kernels.start((stage, "membrane_forces_gather"), Launch::over(particles), &[])
        })
    }

    /// Forces of all patches, added to f.
    pub(super) fn patches_push(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.settle()?;
        let particles = Launch::over(self.count());
        let stage = "bending_forces";
        self.stage(stage, |kernels| {
            kernels.bending_start([T::ONE, T::ONE, T::ZERO])?;
            kernels.start((stage, "bending_forces_gather"), particles, &[])
        })
    }

    /// Folds, and what patches ask of them: `still` times how far they are from rest, and rates `moving` times the damping of a patch and `ahead` more.
    pub(super) fn bending_start(&mut self, [still, moving, ahead]: [T; 3]) -> Result<()> {
        let data = &self.memory.data;
        let [triangles, folds] = [data.element_count, data.fold_count].map(|n| n as usize);
        if folds == 0 {
            return Ok(());
        }
        let module = "bending_forces";
        let arguments = [argument(&still), argument(&moving), argument(&ahead)];
        self.start((module, "bending_forces_folds"), Launch::over(folds), &[])?;
        self.start((module, "bending_forces_moments"), Launch::over(triangles), &arguments)?;
        self.start((module, "bending_forces"), Launch::over(folds), &[])
    }

    /// `membrane_linearise`.
    pub(super) fn membranes_linearise(
        &mut self,
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
        let stage = "membrane_linearise";
        self.stage(stage, |kernels| {
            kernels.linear_start((stage, stage), launch, &[argument(&from_start)])
        })
    }

    /// `bending_linearise`.
    pub(super) fn patches_linearise(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.settle()?;
        let length = T::from_f64(substep.length);
        self.linear()?.length_set(length);
        let ahead = if start == NewtonStart::StepStart { length * length } else { T::ZERO };
        let launch = Launch::over(self.memory.data.fold_count as usize);
        let stage = "bending_linearise";
        self.stage(stage, |kernels| {
            kernels.bending_start([length, length, ahead])?;
            kernels.linear_start((stage, stage), launch, &[])
        })
    }

    /// What they add to the matrix.
    pub(super) fn fabric_assemble(&mut self) -> Result<()> {
        let Some(elements) = &self.linear()?.elements else { return Ok(()) };
        let launch = Launch::over(elements.place_count());
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
        let folds = Launch::over(self.memory.data.fold_count.max(1) as usize);
        self.stage("measure", |kernels| {
            kernels.start(("bending_forces", "bending_forces_folds"), folds, &[])?;
            kernels.start(("measure", "measure_fabric"), launch, &[argument(&address)])
        })?;
        let mut partials = Vec::new();
        out.read(&self.memory.queue, &mut partials)?;
        Ok(FabricSums::new(count, &partials))
    }
}
