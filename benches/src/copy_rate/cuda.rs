//! What copies in the memory of a GPU reach, through CUDA.

use std::sync::Arc;

use cudarc::driver::{CudaContext, DriverError, sys::CUevent_flags};

/// Numbers in an array: more than any cache holds.
const COUNT: usize = 1 << 28;
/// Copies in a row.
const COPIES: usize = 16;

/// GB/s, read and written counted.
///
/// # Errors
/// What the driver reports, out of memory among it.
pub fn copy_rate_cuda(context: &Arc<CudaContext>) -> Result<f64, DriverError> {
    let stream = context.new_stream()?;
    let source = stream.alloc_zeros::<f32>(COUNT)?;
    let mut copied = stream.alloc_zeros::<f32>(COUNT)?;
    stream.memcpy_dtod(&source, &mut copied)?;
    let flags = Some(CUevent_flags::CU_EVENT_DEFAULT);
    let start = stream.record_event(flags)?;
    for _ in 0..COPIES {
        stream.memcpy_dtod(&source, &mut copied)?;
    }
    let end = stream.record_event(flags)?;
    stream.synchronize()?;
    let seconds = f64::from(start.elapsed_ms(&end)?) * 1e-3;
    Ok((2 * COPIES * COUNT * size_of::<f32>()) as f64 / seconds / 1e9)
}
