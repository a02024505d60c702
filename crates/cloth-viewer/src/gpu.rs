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

    /// What is in the first `size` bytes of a buffer that can be mapped, as `content` sees them; waits for the device.
    pub(crate) fn mapped<T>(
        &self,
        buffer: &wgpu::Buffer,
        size: u64,
        content: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, ViewerError> {
        let lost = |reason: String| ViewerError::Device { reason };
        let slice = buffer.slice(..size);
        let (sender, receiver) = std::sync::mpsc::channel();
        slice.map_async(wgpu::MapMode::Read, move |outcome| {
            // The receiver is gone only if waiting failed, which is reported below.
            let _ = sender.send(outcome);
        });
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| lost(error.to_string()))?;
        receiver
            .recv()
            .map_err(|error| lost(error.to_string()))?
            .map_err(|error| lost(error.to_string()))?;
        let bytes = slice.get_mapped_range().map_err(|error| lost(error.to_string()))?;
        Ok(content(&bytes))
    }

    /// The first `count` vectors of a buffer of `vec4<f32>`, without their fourth numbers; waits for the device.
    pub(crate) fn vectors_read(
        &self,
        buffer: &wgpu::Buffer,
        count: usize,
    ) -> Result<Vec<[f64; 3]>, ViewerError> {
        let size = 16 * count as u64;
        let copy = self.empty_buffer("vectors", size, wgpu::BufferUsages::MAP_READ);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, size);
        self.queue.submit([encoder.finish()]);
        self.mapped(&copy, size, |bytes| {
            let vectors = bytes.chunks_exact(16).map(|bytes| {
                let [x, y, z, _]: [f32; 4] = bytemuck::pod_read_unaligned(bytes);
                [x, y, z].map(f64::from)
            });
            vectors.collect()
        })
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
