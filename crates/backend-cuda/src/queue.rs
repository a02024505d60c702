//! A stream of work on a device, and device memory.

use std::{cell::Cell, ffi::c_void, marker::PhantomData, sync::Arc};

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
    /// Whether data was moved or waited for since somebody asked.
    moved_data: Cell<bool>,
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
        Ok(Self { device, stream, moved_data: Cell::new(false) })
    }

    pub(crate) const fn stream(&self) -> sys::CUstream {
        self.stream
    }

    /// Whether data was moved, or the host has waited, since [`Self::moved_data_forget`]: the device may have been idle.
    pub(crate) const fn moved_data(&self) -> bool {
        self.moved_data.get()
    }

    pub(crate) fn moved_data_forget(&self) {
        self.moved_data.set(false);
    }

    /// Makes the context current for a move of data.
    fn bind(&self) -> Result<()> {
        self.moved_data.set(true);
        self.device.bind()
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
        self.bind()?;
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
        queue.bind()?;
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
        queue.bind()?;
        let to = self.at(first, entries.len());
        // SAFETY: the range was checked. From pageable memory the driver has taken a copy, or is done, when
        // the call returns.
        unsafe { result::memcpy_htod_async(to, entries, queue.stream) }.engine()
    }

    /// Makes room for so many entries, with some more for the next time. What was there is lost where there was less.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn grow(&mut self, queue: &Queue, count: usize) -> Result<()> {
        if self.length < count {
            queue.synchronize()?;
            *self = Self::zeros(queue, count + count / 4)?;
        }
        Ok(())
    }

    /// Writes the first entries, and makes room for them before.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn write_growing(&mut self, queue: &Queue, entries: &[T]) -> Result<()> {
        self.grow(queue, entries.len())?;
        self.write(queue, 0, entries)
    }

    /// Makes some of the bytes of the array zero.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn clear_bytes(&mut self, queue: &Queue, first: usize, bytes: usize) -> Result<()> {
        assert!(first + bytes <= self.length * size_of::<T>(), "access beyond a device array");
        queue.bind()?;
        let at = self.address + first as u64;
        // SAFETY: the range was checked.
        unsafe { result::memset_d8_async(at, 0, bytes, queue.stream) }.engine()
    }

    /// Takes the contents of an array of the same length.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn copy_from(&mut self, queue: &Queue, other: &Self) -> Result<()> {
        queue.bind()?;
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
            queue.bind()?;
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

/// An array on the device that the host writes as a whole: by way of memory that the device reads by itself, which is several times as fast as from any
/// other.
pub(crate) struct Staged<T> {
    host: *mut T,
    room: usize,
    buffer: Buffer<T>,
}

// SAFETY: the memory of the host is owned by this alone, and its address holds in all threads.
unsafe impl<T: Send> Send for Staged<T> {}

impl<T: Pod> Staged<T> {
    /// Of no length.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue) -> Result<Self> {
        Ok(Self { host: std::ptr::null_mut(), room: 0, buffer: Buffer::zeros(queue, 0)? })
    }

    /// The address on the device.
    pub(crate) const fn address(&self) -> u64 {
        self.buffer.address()
    }

    /// Lets `fill` write `count` entries, whatever they hold before, and gives them to the device. The caller has waited for the queue since the last time:
    /// what the device has not yet read would change.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(crate) fn write(
        &mut self,
        queue: &Queue,
        count: usize,
        fill: impl FnOnce(&mut [T]),
    ) -> Result<()> {
        if self.room < count {
            let room = count + count / 4;
            let bytes = room * size_of::<T>();
            let old = std::mem::replace(&mut self.host, std::ptr::null_mut());
            self.room = 0;
            host_free(old);
            // SAFETY: freed once, when this is dropped or grows.
            let host = unsafe { result::malloc_host(bytes, 0) };
            self.host = host.map_err(|error| fault(error, bytes))?.cast();
            // SAFETY: so many bytes were just allocated; zeros are entries of a plain type.
            unsafe { std::ptr::write_bytes(self.host, 0, room) };
            self.room = room;
            self.buffer = Buffer::zeros(queue, room)?;
        }
        if count == 0 {
            return Ok(());
        }
        // SAFETY: there is room for so many entries, which were written when it was made, and nobody else on the host has them.
        let entries = unsafe { std::slice::from_raw_parts_mut(self.host, count) };
        fill(entries);
        self.buffer.write(queue, 0, entries)
    }
}

impl<T> Drop for Staged<T> {
    fn drop(&mut self) {
        if self.buffer.device.bind().is_ok() {
            host_free(self.host);
        }
    }
}

/// Frees memory of [`Staged`]. The driver waits for what reads it.
fn host_free<T>(host: *mut T) {
    if !host.is_null() {
        // SAFETY: allocated once by `malloc_host`, and not used after this.
        let _ = unsafe { result::free_host(host.cast()) };
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
