//! A device with its kernels, shared by all solvers of a backend.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use cloth_core::{Error, Result};
use cloth_kernels::{WgslBinding, WgslBindingKind, WgslModule, wgsl_bindings};

use crate::{
    fault::{BACKEND, Faults},
    procedural,
};

/// A device, its queue and the kernels compiled for it so far.
#[derive(Debug)]
pub(crate) struct DeviceContext {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) limits: wgpu::Limits,
    pub(crate) faults: Faults,
    /// Bytes that were read back so far.
    pub(crate) bytes_read: Arc<AtomicU64>,
    /// Whether solvers that are made are to take the time of every stage.
    stage_times: AtomicBool,
    kernels: Mutex<HashMap<KernelKey, Arc<Kernel>>>,
}

/// Module, options, and a part written for a model.
type KernelKey = (&'static str, Vec<&'static str>, Option<Arc<str>>);

/// A compiled kernel.
#[derive(Debug)]
pub(crate) struct Kernel {
    /// Name of its module.
    pub(crate) name: &'static str,
    pub(crate) pipeline: wgpu::ComputePipeline,
    pub(crate) layout: wgpu::BindGroupLayout,
    /// What it binds, in the order of the numbers.
    pub(crate) bindings: Vec<WgslBinding>,
}

/// Uniform buffers of which one entry is chosen when a kernel is started.
pub(crate) const DYNAMIC: [&str; 3] = ["substep", "colour", "call"];

impl DeviceContext {
    pub(crate) fn new(device: wgpu::Device, queue: wgpu::Queue, stage_times: bool) -> Self {
        let faults = Faults::listen(&device);
        let limits = device.limits();
        let context = Self {
            device,
            queue,
            limits,
            faults,
            bytes_read: Arc::default(),
            stage_times: AtomicBool::new(false),
            kernels: Mutex::default(),
        };
        context.stage_times_set(stage_times);
        context
    }

    /// Whether solvers that are made are to take the time of every stage.
    pub(crate) fn stage_times(&self) -> bool {
        self.stage_times.load(Ordering::Relaxed)
    }

    /// Asks for the times of stages, of which there are none on a device without time stamps.
    pub(crate) fn stage_times_set(&self, on: bool) {
        let can = self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        self.stage_times.store(on && can, Ordering::Relaxed);
    }

    /// The kernel of a module with some of its options, compiled now if it is the first time.
    /// `procedural` is the part for procedural fields, if the module has one.
    ///
    /// # Errors
    /// `LimitExceeded` if it binds more buffers than the device allows; `KernelCompile`.
    pub(crate) fn kernel(
        &self,
        name: &'static str,
        options: &[&'static str],
        procedural: Option<&Arc<str>>,
    ) -> Result<Arc<Kernel>> {
        let key = (name, options.to_vec(), procedural.map(Arc::clone));
        let mut kernels = self.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = kernels.get(&key) {
            return Ok(Arc::clone(kernel));
        }
        let kernel = Arc::new(self.kernel_compile(name, options, procedural)?);
        kernels.insert(key, Arc::clone(&kernel));
        Ok(kernel)
    }

    fn kernel_compile(
        &self,
        name: &'static str,
        options: &[&str],
        procedural: Option<&Arc<str>>,
    ) -> Result<Kernel> {
        let fail = |log: String| Error::KernelCompile { kernel: name, log };
        let module =
            WgslModule::find(name).ok_or_else(|| fail("there is no such module".into()))?;
        let parts: Vec<_> =
            procedural.map(|part| (procedural::PART, &**part)).into_iter().collect();
        let text = module.compose_with(options, &parts).map_err(|error| fail(error.to_string()))?;
        let bindings = wgsl_bindings(&text);
        self.bindings_check(&bindings)?;
        let entries: Vec<_> = bindings.iter().map(layout_entry).collect();
        let made = self.scoped(wgpu::ErrorFilter::Validation, |device| {
            let shader = shader_create(device, name, text);
            let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(name),
                entries: &entries,
            });
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&pipeline_layout),
                module: &shader,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // Kernels write what they read there: one thread would set all to zero before.
                    zero_initialize_workgroup_memory: false,
                    ..wgpu::PipelineCompilationOptions::default()
                },
                cache: None,
            });
            (pipeline, layout)
        });
        self.faults.check()?;
        let (pipeline, layout) = made.map_err(|error| fail(error.to_string()))?;
        Ok(Kernel { name, pipeline, layout, bindings })
    }

    /// Runs `work`; its error, if it caused one that passes the filter.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn scoped<R>(
        &self,
        filter: wgpu::ErrorFilter,
        work: impl FnOnce(&wgpu::Device) -> R,
    ) -> std::result::Result<R, wgpu::Error> {
        let scope = self.device.push_error_scope(filter);
        let result = work(&self.device);
        // The answer is there at once on native platforms.
        pollster::block_on(scope.pop()).map_or(Ok(result), Err)
    }

    /// Runs `work`. In a browser the answer comes later, and nothing may wait for it: errors go to
    /// `faults`.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn scoped<R>(
        &self,
        _filter: wgpu::ErrorFilter,
        work: impl FnOnce(&wgpu::Device) -> R,
    ) -> std::result::Result<R, wgpu::Error> {
        Ok(work(&self.device))
    }

    fn bindings_check(&self, bindings: &[WgslBinding]) -> Result<()> {
        let storage = bindings.iter().filter(|binding| binding.kind != WgslBindingKind::Uniform);
        let storage = storage.count() as u64;
        let max = u64::from(self.limits.max_storage_buffers_per_shader_stage);
        if storage > max {
            return Err(Error::LimitExceeded {
                limit: "storage buffers of a kernel (max_storage_buffers_per_shader_stage)",
                requested: storage,
                max,
            });
        }
        Ok(())
    }

    /// Hands recorded work to the device.
    pub(crate) fn submit(&self, commands: wgpu::CommandBuffer) -> Result<()> {
        self.faults.check()?;
        self.queue.submit([commands]);
        self.faults.check()
    }

    /// Waits until the device has done everything it was given.
    pub(crate) fn wait(&self) -> Result<()> {
        self.poll(wgpu::PollType::wait_indefinitely())
    }

    /// Waits until the device has done all work up to a submission.
    pub(crate) fn wait_for(&self, submission: wgpu::SubmissionIndex) -> Result<()> {
        self.poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
    }

    fn poll(&self, until: wgpu::PollType) -> Result<()> {
        let outcome = self.device.poll(until);
        self.faults.check()?;
        match outcome {
            Ok(_) => Ok(()),
            Err(error) => Err(Error::DeviceLost { backend: BACKEND, reason: error.to_string() }),
        }
    }
}

fn layout_entry(binding: &WgslBinding) -> wgpu::BindGroupLayoutEntry {
    let kind = match binding.kind {
        WgslBindingKind::Uniform => wgpu::BufferBindingType::Uniform,
        WgslBindingKind::StorageRead => wgpu::BufferBindingType::Storage { read_only: true },
        WgslBindingKind::StorageWrite => wgpu::BufferBindingType::Storage { read_only: false },
    };
    wgpu::BindGroupLayoutEntry {
        binding: binding.number,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: kind,
            has_dynamic_offset: DYNAMIC.contains(&binding.name.as_str()),
            min_binding_size: None,
        },
        count: None,
    }
}

/// Compiles the text of a kernel. What it reads and writes is checked; turns of its loops are not counted, which
/// would cost 3 to 6 % of the time of a frame.
#[allow(unsafe_code)]
fn shader_create(device: &wgpu::Device, name: &str, text: String) -> wgpu::ShaderModule {
    let descriptor = wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    };
    let checks = wgpu::ShaderRuntimeChecks {
        force_loop_bounding: false,
        ..wgpu::ShaderRuntimeChecks::checked()
    };
    // SAFETY: what is not checked is that loops end. Those of the kernels go over ranges, set bits and chains without
    // cycles, and the programs of procedural fields have none.
    unsafe { device.create_shader_module_trusted(descriptor, checks) }
}
