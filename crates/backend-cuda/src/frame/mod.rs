//! The kernel of explicit frames for a model: which form it takes, and its launch.

mod pass;
mod stages;

use std::any::Any;

use cloth_core::{Integrator, Model, ModelFeatures, Result, SolverConfig};

use crate::{
    forms::{FrameForm, FrameSizes},
    kernel_cache::KernelCache,
    layout::{CudaReal, SolverData},
    patch::Patch,
    queue::{Launch, Queue},
    tables::{SpringTables, StrainTables},
};

/// Substeps that are done in one launch at most.
const SUBSTEPS_MAX: usize = 1024;

/// What forms depend on beside features.
pub(crate) fn sizes<T: CudaReal>(
    model: &Model,
    springs: &SpringTables<T>,
    multiprocessors: usize,
) -> FrameSizes {
    let in_shared = pass::is_in_shared(springs);
    FrameSizes {
        particles: model.particle_count(),
        patch: if in_shared { Patch::of(model) } else { None },
        is_packed: !in_shared && !springs.packed.is_empty(),
        multiprocessors,
    }
}

/// What the kernel of frames is prepared for.
pub(crate) struct FrameModel<'a, T> {
    pub(crate) model: &'a Model,
    pub(crate) springs: &'a SpringTables<T>,
    pub(crate) strain: &'a StrainTables<T>,
    /// Whether it sums what colliders do.
    pub(crate) has_feedback: bool,
}

impl<T: CudaReal> FrameModel<'_, T> {
    /// Options of all general forms.
    fn options_common(&self) -> Vec<&'static str> {
        let mut options = Vec::new();
        let points = self.model.self_contact().filter(|contact| !contact.is_of_triangles());
        if points.is_some_and(|contact| !contact.excludes_neighbours()) {
            options.push("penalty");
        }
        if self.model.air().is_some() || self.springs.can_buckle || self.has_feedback {
            options.push("extras");
        }
        options
    }
}

/// Form and launch of the kernel of frames, with the memory that is its own.
pub(crate) struct FrameLaunch {
    pub(crate) form: FrameForm,
    pub(crate) launch: Launch,
    /// Substeps that one launch may do.
    pub(crate) substeps_max: usize,
    /// How often it writes to the other motion in a substep.
    pub(crate) motions: u32,
    /// Held by `SolverData` through their addresses.
    held: Vec<Box<dyn Any + Send>>,
}

impl FrameLaunch {
    /// Chooses form, variant and size. Gives the patch whose tiles the kernel works on, if it does.
    ///
    /// # Errors
    /// `OutOfMemory`, `KernelCompile`; what the device reports.
    pub(crate) fn new<T: CudaReal>(
        of: &FrameModel<'_, T>,
        config: &SolverConfig,
        queue: &Queue,
        cache: &mut KernelCache,
        data: &mut SolverData<T>,
    ) -> Result<(Self, Option<Patch>)> {
        let device = &queue.device;
        let multiprocessors = device.multiprocessors as usize;
        let sizes = sizes(of.model, of.springs, multiprocessors);
        // Kernels of other integrators look for contact in the groups that the frame kernel has.
        let is_frame =
            config.integrator == Integrator::Explicit && !of.model.has_triangle_contact();
        let form = if is_frame {
            FrameForm::choose(ModelFeatures::new(of.model, config).set(), &sizes)
        } else {
            FrameForm::Pass
        };
        if form == FrameForm::Stages {
            return Ok((stages::launch(of, queue, cache, data)?, None));
        }
        Ok((pass::launch(form, &sizes, of, queue, cache, data)?, sizes.patch))
    }
}
