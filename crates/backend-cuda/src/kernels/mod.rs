//! All stages on the memory of one solver.

mod check;
mod contact;
mod control_forces;
mod explicit;
mod fabric;
mod feedback;
mod implicit;
mod linear;
mod matrix_copy;
mod pair_device;
mod schwarz;
mod semi_implicit;
mod stages;
mod state;
mod triangle_contact;

use std::{ffi::c_void, sync::Arc};

use cloth_core::{
    ContactStatistics, Integrator, Kernels, Model, ModelFeatures, Preconditioner, Result,
    SelfContact, SolverConfig, stepper::Substep,
};

use crate::{
    CudaOptions,
    device::Device,
    foreseen::foreseen,
    frame::{FrameLaunch, FrameModel},
    kernel_cache::KernelCache,
    layout::{CudaReal, SubstepData},
    linear::LinearMemory,
    memory::Memory,
    queue::{Launch, argument},
    tables::StrainTables,
    timing::Timing,
};

use contact::Counts;
use control_forces::ControlForces;
use explicit::FrameQueue;
use semi_implicit::SemiImplicit;
use triangle_contact::Triangles;

/// The stages on a GPU.
pub(crate) struct CudaKernels<T> {
    pub(crate) model: Arc<Model>,
    pub(crate) config: SolverConfig,
    pub(crate) memory: Memory<T>,
    cache: KernelCache,
    /// How a frame of the explicit integrator is launched.
    frame: FrameLaunch,
    timing: Timing,
    frames: FrameQueue<T>,
    control_forces: ControlForces,
    /// Uses of the list of groups so far.
    tick: u32,
    statistics: ContactStatistics,
    counts: Counts,
    has_force: bool,
    /// Memory of the linear system, once it is needed.
    linear: Option<Box<LinearMemory<T>>>,
    semi_implicit: SemiImplicit<T>,
    /// Contact of triangles, if there is any.
    triangles: Option<Box<Triangles<T>>>,
}

impl<T: CudaReal> CudaKernels<T> {
    pub(crate) fn new(
        device: Arc<Device>,
        model: Arc<Model>,
        config: &SolverConfig,
        options: CudaOptions,
    ) -> Result<Self> {
        let config = &config.resolved(&model, Some(Preconditioner::SCHWARZ_MIN));
        check::check_config(config)?;
        let mut cache = KernelCache::new::<T>(Arc::clone(&device), &model, options.fast);
        let features = ModelFeatures::new(&model, config).set();
        let sizes = (model.particle_count(), device.multiprocessors as usize);
        cache.compile_ahead(&foreseen(features, &config.integrator, sizes));
        let strain = StrainTables::new(&model, config.strain_limit.as_ref());
        let mut memory = Memory::new(device, &model, &strain, options.patches)?;
        let Memory { queue, data, tables, feedback, .. } = &mut memory;
        let (springs, has_feedback) = (&tables.springs, feedback.is_some());
        let of = FrameModel { model: &model, springs, strain: &strain, has_feedback };
        let (frame, patch) = FrameLaunch::new(&of, config, queue, &mut cache, data)?;
        memory.contact_prepare(&model, config, patch)?;
        memory.status.reset(&memory.queue)?;
        let mut kernels = Self {
            memory,
            cache,
            frame,
            timing: Timing::default(),
            frames: FrameQueue::default(),
            control_forces: ControlForces::default(),
            tick: 0,
            statistics: ContactStatistics::default(),
            counts: Counts::OfList,
            has_force: false,
            linear: None,
            semi_implicit: SemiImplicit::default(),
            triangles: None,
            config: config.clone(),
            model,
        };
        kernels.triangles_prepare()?;
        let state = kernels.model.initial_state();
        kernels.state_write(&state)?;
        if kernels.config.integrator != Integrator::Explicit {
            kernels.linear()?;
        }
        Ok(kernels)
    }

    pub(crate) fn count(&self) -> usize {
        self.model.particle_count()
    }

    /// Starts a kernel with the memory of the solver as its first argument.
    pub(crate) fn start(
        &mut self,
        (module, name): (&'static str, &'static str),
        launch: Launch,
        more: &[*mut c_void],
    ) -> Result<()> {
        let kernel = self.cache.kernel(module, name)?;
        let data = self.memory.data;
        let mut arguments = vec![argument(&data)];
        arguments.extend_from_slice(more);
        // SAFETY: each caller gives the arguments that the kernel of this name takes; all memory is owned by
        // this solver, which waits for its queue before any of it is freed.
        unsafe { self.memory.queue.launch(kernel, launch, &mut arguments) }
    }

    /// Runs `work` and books its time on the device.
    pub(crate) fn stage<R>(
        &mut self,
        stage: &'static str,
        work: impl FnOnce(&mut Self) -> Result<R>,
    ) -> Result<R> {
        let start = self.timing.begin(&self.memory.queue)?;
        let result = work(self)?;
        self.timing.end(&self.memory.queue, stage, start)?;
        Ok(result)
    }

    /// A stage that is one kernel of the same name over all particles.
    fn particle_stage(&mut self, stage: &'static str, more: &[*mut c_void]) -> Result<()> {
        self.settle()?;
        let launch = Launch::over(self.count());
        self.stage(stage, |kernels| kernels.start((stage, stage), launch, more))
    }

    /// Puts one substep on the device for kernels that read it, as number 0.
    fn substep_write(&mut self, substep: &Substep) -> Result<()> {
        let data = self.substep_data(substep, 0);
        self.substeps_write(&[data])
    }

    fn substeps_write(&mut self, substeps: &[SubstepData<T>]) -> Result<()> {
        let Memory { queue, data, inputs, .. } = &mut self.memory;
        inputs.substeps_write(queue, substeps, data)
    }

    fn substep_data(&self, substep: &Substep, tick: u32) -> SubstepData<T> {
        SubstepData {
            step: substep.step,
            collider_first: self.frames.collider_first(substep.index, self.model.colliders().len()),
            tick,
            length: T::from_f64(substep.length),
            wind: substep.wind_velocity.map(T::from_f64),
            time: T::from_f64(substep.time),
            recovery: Self::recovery(substep.length),
        }
    }

    /// Share of an overlap that impulses take back.
    fn recovery(length: f64) -> T {
        T::from_f64(SelfContact::recovery(length))
    }
}
