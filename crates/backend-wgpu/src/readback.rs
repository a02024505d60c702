//! From device memory to host memory.

use std::{
    pin::Pin,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    task::{Context, Poll, Waker},
};

use cloth_core::{Error, Result};

use crate::{device::DeviceContext, fault::BACKEND};

/// Becomes ready when a buffer is mapped.
#[derive(Clone, Debug, Default)]
struct Mapped(Arc<Mutex<MappedState>>);

#[derive(Debug, Default)]
struct MappedState {
    outcome: Option<std::result::Result<(), wgpu::BufferAsyncError>>,
    waker: Option<Waker>,
}

impl Future for Mapped {
    type Output = std::result::Result<(), wgpu::BufferAsyncError>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match state.outcome.take() {
            Some(outcome) => Poll::Ready(outcome),
            None => {
                state.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

/// A buffer that the host can read.
#[derive(Debug)]
pub(crate) struct Readback {
    buffer: wgpu::Buffer,
    /// Bytes read so far by all of a device.
    total: Arc<AtomicU64>,
}

impl Readback {
    /// Room for `size` bytes.
    pub(crate) fn new(context: &DeviceContext, size: u64) -> Self {
        let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("readback"),
            size: size.next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, total: Arc::clone(&context.bytes_read) }
    }

    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }

    /// The first `size` bytes, as soon as the work submitted before is done. Asked for at once, ready
    /// when whoever polls the device gets there; nothing blocks.
    pub(crate) fn read_async<R>(
        &self,
        size: u64,
        take: impl FnOnce(&[u8]) -> R,
    ) -> impl Future<Output = Result<R>> {
        let mapped = self.map(size);
        async move {
            mapped.await.map_err(|error| lost(&error))?;
            self.take(size, take)
        }
    }

    /// The same, waiting for the device.
    pub(crate) fn read<R>(
        &self,
        context: &DeviceContext,
        size: u64,
        take: impl FnOnce(&[u8]) -> R,
    ) -> Result<R> {
        let ready = self.read_async(size, take);
        context.wait()?;
        pollster::block_on(ready)
    }

    fn map(&self, size: u64) -> Mapped {
        let mapped = Mapped::default();
        let state = Arc::clone(&mapped.0);
        self.buffer.slice(..size).map_async(wgpu::MapMode::Read, move |outcome| {
            let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
            state.outcome = Some(outcome);
            if let Some(waker) = state.waker.take() {
                waker.wake();
            }
        });
        mapped
    }

    fn take<R>(&self, size: u64, take: impl FnOnce(&[u8]) -> R) -> Result<R> {
        let result = {
            let view =
                self.buffer.slice(..size).get_mapped_range().map_err(|error| lost(&error))?;
            take(&view)
        };
        self.buffer.unmap();
        self.total.fetch_add(size, Ordering::Relaxed);
        Ok(result)
    }
}

/// Something that was asked for and is not yet there.
#[derive(Debug)]
pub(crate) struct Answer {
    readback: Readback,
    size: u64,
    mapped: Mapped,
    /// The work that it comes after.
    submission: wgpu::SubmissionIndex,
}

impl Answer {
    /// The first `size` bytes of `readback` after all work submitted so far. Nothing blocks.
    pub(crate) fn ask(context: &DeviceContext, readback: Readback, size: u64) -> Self {
        let submission = context.queue.submit([]);
        let mapped = readback.map(size);
        Self { readback, size, mapped, submission }
    }

    /// Waits for it, and for no work submitted later.
    pub(crate) fn wait<R>(
        self,
        context: &DeviceContext,
        take: impl FnOnce(&[u8]) -> R,
    ) -> Result<R> {
        context.wait_for(self.submission)?;
        pollster::block_on(self.mapped).map_err(|error| lost(&error))?;
        self.readback.take(self.size, take)
    }
}

fn lost(error: &dyn std::error::Error) -> Error {
    Error::DeviceLost { backend: BACKEND, reason: error.to_string() }
}
