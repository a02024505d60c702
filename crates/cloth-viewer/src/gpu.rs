//! The device that draws.

use std::sync::Arc;

use cloth::wgpu::{WgpuBackend, WgpuOptions, wgpu};

use crate::ViewerError;

/// A device and its queue, cheap to clone.
#[derive(Clone)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// One for all solvers, as it keeps the kernels that it compiled.
    backend: Arc<WgpuBackend>,
}

impl Gpu {
    /// Opens a device without a window: the one with this number, or whose name contains this text;
    /// the best one if `None`.
    ///
    /// # Errors
    /// [`ViewerError::Simulation`] with what there is and which package brings a driver.
    pub fn headless(adapter: Option<&str>) -> Result<Self, ViewerError> {
        let options = WgpuOptions { adapter: adapter.map(str::to_owned), ..WgpuOptions::default() };
        let backend = WgpuBackend::with_options(&options)?;
        Ok(Self {
            device: backend.device().clone(),
            queue: backend.queue().clone(),
            backend: Arc::new(backend),
        })
    }

    /// A device that exists, such as that of a window.
    #[must_use]
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let backend = WgpuBackend::from_device(device.clone(), queue.clone());
        Self { device, queue, backend: Arc::new(backend) }
    }

    /// Name of the device and the interface through which it is reached.
    #[must_use]
    pub fn description(&self) -> String {
        let info = self.device.adapter_info();
        format!("{} ({})", info.name, info.backend)
    }

    /// Whether the device computes on the processor.
    #[must_use]
    pub fn is_processor(&self) -> bool {
        self.device.adapter_info().device_type == wgpu::DeviceType::Cpu
    }

    /// The simulation backend on this device.
    #[must_use]
    pub fn backend(&self) -> &WgpuBackend {
        &self.backend
    }

    /// A buffer with `contents`, of at least four bytes, as no binding may be empty.
    pub(crate) fn buffer<T: bytemuck::NoUninit>(
        &self,
        label: &str,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        let buffer = self.empty_buffer(label, bytes.len() as u64, usage);
        if !bytes.is_empty() {
            self.queue.write_buffer(&buffer, 0, bytes);
        }
        buffer
    }

    /// A buffer of `size` bytes, at least four.
    pub(crate) fn empty_buffer(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.max(16),
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }
}
