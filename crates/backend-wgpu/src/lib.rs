//! GPU backend, through wgpu: Vulkan, Metal or DirectX 12.
//!
//! Each stage of NUMERICS is a WGSL kernel of its name in the package `cloth-kernels`. The state stays
//! in device memory; a frame is recorded as a whole and handed over once. A substep of the explicit
//! integrator is one dispatch, unless contact by impulses or strain limiting come between its parts. Linear
//! solvers of the implicit integrators decide on the device when they are done.
//!
//! - [`WgpuBackend`] finds an adapter, or takes a device that exists;
//! - [`adapters()`] lists what there is;
//! - [`WgpuSolver`] lends its buffers to a renderer on the same device.
//!
//! Arithmetic is in f32. Sums of products are written as fused multiply-adds, so that no compiler has a choice in
//! them: the fused substep gives the bits of its stages. Bits differ between drivers, as WGSL allows a
//! few units in the last place for division and square root.
//!
//! Nothing in the parts that wait for nobody ([`WgpuBackend::open`], [`adapters_async`],
//! [`WgpuBackend::from_device`]) blocks. Calls that return results wait for the device.

mod adapter;
mod buffers;
mod contact;
mod device;
mod dispatch;
mod fault;
mod figures;
mod forms;
mod kernels;
mod layout;
mod linear;
mod procedural;
mod readback;
mod recorder;
mod slots;
mod solver;
mod stages;
mod tables;
mod triangle_contact;

/// How it works, with the table of its forms.
pub mod how_it_works {
    #![doc = include_str!("../BACKEND.md")]
}

use std::sync::Arc;

use cloth_core::{
    Backend, BackendInfo, Error, FormChoice, Kernels, Model, Precision, Result, Solver,
    SolverConfig, stepper::SteppedSolver,
};

pub use adapter::{AdapterDescription, adapters, adapters_async};
pub use kernels::WgpuKernels;
pub use solver::{DeviceBuffers, WgpuSolver};
pub use wgpu;

use device::DeviceContext;
use fault::BACKEND;
use stages::Stages;

/// A GPU.
#[derive(Clone)]
pub struct WgpuBackend {
    info: BackendInfo,
    context: Arc<DeviceContext>,
}

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct WgpuOptions {
    /// Number of the adapter or part of its name, `None` for the best one. `gl` or `gl:NAME` takes an
    /// OpenGL adapter, which is never taken without being asked for.
    pub adapter: Option<String>,
    /// Limits to ask for instead of all that the adapter has.
    pub limits: Option<wgpu::Limits>,
    /// Whether to take the time of every stage, where the adapter can: from when it begins to when the next one does. Costs
    /// speed, as the host then waits for the device to give them.
    pub stage_times: bool,
}

impl WgpuBackend {
    /// The adapter with this number, or whose name contains this text; the best one if `None`.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with what there is and how to get one.
    pub fn new(adapter: Option<&str>) -> Result<Self> {
        Self::with_options(&WgpuOptions {
            adapter: adapter.map(str::to_owned),
            ..WgpuOptions::default()
        })
    }

    /// As [`Self::open`], waiting for the device.
    ///
    /// # Errors
    /// Those of [`Self::open`].
    pub fn with_options(options: &WgpuOptions) -> Result<Self> {
        pollster::block_on(Self::open(options))
    }

    /// Opens a device. Does not block.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with what there is and how to get one, also where the adapter cannot compute
    /// or lacks the limits asked for.
    pub async fn open(options: &WgpuOptions) -> Result<Self> {
        let adapter = adapter::adapter_choose(options.adapter.as_deref()).await?;
        let info = adapter.get_info();
        let no_device = |reason: String| Error::NoDevice {
            backend: BACKEND,
            reason: format!("{}: {reason}", info.name),
        };
        if !adapter
            .get_downlevel_capabilities()
            .flags
            .contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
        {
            return Err(no_device("it has no compute shaders; choose another adapter".into()));
        }
        let mut features = wgpu::Features::empty();
        if options.stage_times {
            features |= adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("cloth"),
            required_features: features,
            required_limits: options.limits.clone().unwrap_or_else(|| adapter.limits()),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|error| no_device(error.to_string()))?;
        Ok(Self::with_context(DeviceContext::new(device, queue, options.stage_times)))
    }

    /// A backend on a device that exists, such as that of a renderer, whose buffers solvers can then
    /// share.
    #[must_use]
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        Self::with_context(DeviceContext::new(device, queue, false))
    }

    /// Whether solvers that are made from now on take the time of every stage, as
    /// [`WgpuOptions::stage_times`] does; the device must have been opened with time stamps.
    pub fn stage_times_set(&self, on: bool) {
        self.context.stage_times_set(on);
    }

    fn with_context(context: DeviceContext) -> Self {
        let info = context.device.adapter_info();
        let limits = &context.limits;
        let details = vec![
            ("interface", adapter::interface_name(info.backend).to_owned()),
            ("kind", adapter::kind_name(info.device_type).to_owned()),
            ("driver", format!("{} {}", info.driver, info.driver_info).trim().to_owned()),
            ("largest buffer", bytes_text(limits.max_storage_buffer_binding_size)),
            ("buffers of a kernel", limits.max_storage_buffers_per_shader_stage.to_string()),
        ];
        let info = BackendInfo {
            name: BACKEND,
            device: info.name,
            precisions: vec![Precision::F32],
            details,
        };
        Self { info, context: Arc::new(context) }
    }

    /// The interface through which the device is reached.
    #[must_use]
    pub fn interface(&self) -> wgpu::Backend {
        self.context.device.adapter_info().backend
    }

    /// Whether the device computes on the processor.
    #[must_use]
    pub fn is_processor(&self) -> bool {
        self.context.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// Bytes that solvers on this device have copied to the host so far: states, normals, and the results of frames, which are some
    /// hundred bytes each. Those that lend their buffers to a renderer need not copy states.
    #[must_use]
    pub fn bytes_read(&self) -> u64 {
        self.context.bytes_read.load(std::sync::atomic::Ordering::Relaxed)
    }

    /// The device.
    #[must_use]
    pub fn device(&self) -> &wgpu::Device {
        &self.context.device
    }

    /// Its queue.
    #[must_use]
    pub fn queue(&self) -> &wgpu::Queue {
        &self.context.queue
    }

    fn kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<WgpuKernels> {
        model.check_integrator(config, "wgpu")?;
        let config = config.resolved(&model, None);
        Ok(WgpuKernels::new(Stages::new(Arc::clone(&self.context), model, &config)?))
    }

    /// As [`Backend::create_solver`], for a solver that can lend its buffers.
    ///
    /// # Errors
    /// Those of [`Backend::create_solver`].
    pub fn create_wgpu_solver(
        &self,
        model: Arc<Model>,
        config: &SolverConfig,
    ) -> Result<WgpuSolver> {
        Ok(WgpuSolver::new(SteppedSolver::new(self.kernels(model, config)?)?))
    }
}

impl Backend for WgpuBackend {
    fn info(&self) -> &BackendInfo {
        &self.info
    }

    fn share(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(self.clone()))
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        Ok(Box::new(self.create_wgpu_solver(model, config)?))
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        Ok(Box::new(self.kernels(model, config)?))
    }

    fn forms(&self, model: &Model, config: &SolverConfig) -> Vec<FormChoice> {
        let memory = self.context.limits.max_compute_workgroup_storage_size;
        forms::choices(model, config, memory)
    }
}

fn bytes_text(bytes: u64) -> String {
    format!("{} MiB", bytes >> 20)
}
