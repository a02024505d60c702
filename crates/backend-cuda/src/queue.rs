//! A stream of work on a device, and device memory.

use std::{ffi::c_void, marker::PhantomData, sync::Arc};

use bytemuck::Pod;
use cloth_core::Result;
use cudarc::driver::{result, sys};

use crate::{
    device::{Device, Kernel},
    fault::{DriverResult, fault},
};

/// Threads of a block, where nothing else is said.
pub(crate) const THREADS: u32 = 256;

/// Work on a device, done in order.
pub(crate) struct Queue {
    pub(crate) device: Arc<Device>,
    stream: sys::CUstream,
}

// SAFETY: a stream may be used from any thread that has made its context current, which every use does.
unsafe impl Send for Queue {}

/// Size of a launch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Launch {
    pub(crate) blocks: u32,
    pub(crate) threads: u32,
    /// Bytes of dynamic shared memory.
    pub(crate) shared: usize,
    /// Whether all blocks have to be resident.
    pub(crate) cooperative: bool,
}

impl Launch {
    /// One thread for each of `items`.
    pub(crate) fn over(items: usize) -> Self {
        let blocks = (items as u32).div_ceil(THREADS).max(1);
        Self { blocks, threads: THREADS, shared: 0, cooperative: false }
    }
}

/// The argument of a kernel that lies at `value`.
pub(crate) fn argument<T>(value: &T) -> *mut c_void {
    std::ptr::from_ref(value).cast_mut().cast()
}

impl Queue {
    pub(crate) fn new(device: Arc<Device>) -> Result<Self> {
        device.bind()?;
        let stream = result::stream::create(result::stream::StreamKind::NonBlocking).engine()?;
        Ok(Self { device, stream })
    }

    pub(crate) const fn stream(&self) -> sys::CUstream {
        self.stream
    }

    /// Starts a kernel.
    ///
    /// # Errors
    /// `DeviceLost`.
    ///
    /// # Safety
    /// `arguments` are those of the kernel, in order and of its types, and all device memory they name
    /// lives until the queue is synchronised.
    pub(crate) unsafe fn launch(
        &self,
        kernel: Kernel,
        launch: Launch,
        arguments: &mut [*mut c_void],
    ) -> Result<()> {
        self.device.bind()?;
        let Launch { blocks, threads, shared, cooperative } = launch;
        let (grid, block) = ((blocks, 1, 1), (threads, 1, 1));
        let start =
            if cooperative { result::launch_cooperative_kernel } else { result::launch_kernel };
        // SAFETY: what the caller promises.
        unsafe { start(kernel.0, grid, block, shared as u32, self.stream, arguments) }.engine()
    }

    /// Waits for everything.
    ///
    /// # Errors
    /// `DeviceLost` if something went wrong on the device.
    pub(crate) fn synchronize(&self) -> Result<()> {
        self.device.bind()?;
        // SAFETY: the stream lives as long as this.
        unsafe { result::stream::synchronize(self.stream) }.engine()
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        if self.device.bind().is_ok() {
            // SAFETY: nobody else has the stream; work on it is finished by the driver.
            let _ = unsafe { result::stream::synchronize(self.stream) };
            // SAFETY: as above.
            let _ = unsafe { result::stream::destroy(self.stream) };
        }
    }
}

/// An array in device memory.
pub(crate) struct Buffer<T> {
    device: Arc<Device>,
    address: sys::CUdeviceptr,
    length: usize,
    entries: PhantomData<T>,
}

impl<T: Pod> Buffer<T> {
    /// An array of zeros; one of no length still has an address.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn zeros(queue: &Queue, length: usize) -> Result<Self> {
        queue.device.bind()?;
        let bytes = (length * size_of::<T>()).max(16);
        // SAFETY: freed once, when this is dropped.
        let address = unsafe { result::malloc_sync(bytes) }.map_err(|error| fault(error, bytes))?;
        let buffer =
            Self { device: Arc::clone(&queue.device), address, length, entries: PhantomData };
        // SAFETY: the range was just allocated.
        unsafe { result::memset_d8_async(address, 0, bytes, queue.stream) }.engine()?;
        Ok(buffer)
    }

    /// An array with these entries.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn of(queue: &Queue, entries: &[T]) -> Result<Self> {
        let mut buffer = Self::zeros(queue, entries.len())?;
        buffer.write(queue, 0, entries)?;
        Ok(buffer)
    }

    pub(crate) const fn len(&self) -> usize {
        self.length
    }

    /// The address on the device.
    pub(crate) const fn address(&self) -> u64 {
        self.address
    }

    fn at(&self, first: usize, length: usize) -> sys::CUdeviceptr {
        assert!(first + length <= self.length, "access beyond the end of a device array");
        self.address + (first * size_of::<T>()) as u64
    }

    /// Writes entries from `first` on.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn write(&mut self, queue: &Queue, first: usize, entries: &[T]) -> Result<()> {
        if entries.is_empty() {
            return Ok(());
        }
        queue.device.bind()?;
        let to = self.at(first, entries.len());
        // SAFETY: the range was checked. From pageable memory the driver has taken a copy, or is done, when
        // the call returns.
        unsafe { result::memcpy_htod_async(to, entries, queue.stream) }.engine()
    }

    /// Writes the first entries, and makes room for them before, with some more for the next time.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn write_growing(&mut self, queue: &Queue, entries: &[T]) -> Result<()> {
        if self.length < entries.len() {
            queue.synchronize()?;
            *self = Self::zeros(queue, entries.len() + entries.len() / 4)?;
        }
        self.write(queue, 0, entries)
    }

    /// Makes some of the bytes of the array zero.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn clear_bytes(&mut self, queue: &Queue, first: usize, bytes: usize) -> Result<()> {
        assert!(first + bytes <= self.length * size_of::<T>(), "access beyond a device array");
        queue.device.bind()?;
        let at = self.address + first as u64;
        // SAFETY: the range was checked.
        unsafe { result::memset_d8_async(at, 0, bytes, queue.stream) }.engine()
    }

    /// Takes the contents of an array of the same length.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn copy_from(&mut self, queue: &Queue, other: &Self) -> Result<()> {
        queue.device.bind()?;
        let bytes = self.length.min(other.length) * size_of::<T>();
        if bytes == 0 {
            return Ok(());
        }
        // SAFETY: both ranges are within their arrays.
        unsafe { result::memcpy_dtod_async(self.address, other.address, bytes, queue.stream) }
            .engine()
    }

    /// Waits for all work and reads the first entries.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn read_first(&self, queue: &Queue, count: usize, out: &mut Vec<T>) -> Result<()> {
        out.resize(count, T::zeroed());
        if count > 0 {
            queue.device.bind()?;
            let from = self.at(0, count);
            // SAFETY: the range was checked; it is waited for below.
            unsafe { result::memcpy_dtoh_async(out, from, queue.stream) }.engine()?;
        }
        queue.synchronize()
    }

    /// Waits for all work and reads the whole array.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn read(&self, queue: &Queue, out: &mut Vec<T>) -> Result<()> {
        self.read_first(queue, self.length, out)
    }
}

impl<T> Drop for Buffer<T> {
    fn drop(&mut self) {
        if self.device.bind().is_ok() {
            // SAFETY: allocated once by `zeros`. The driver waits for kernels that use it.
            let _ = unsafe { result::free_sync(self.address) };
        }
    }
}
