//! Errors of the driver as those of the engine.

use cloth_core::Error;
use cudarc::driver::{DriverError, result, sys::CUresult};

/// The name of this backend in errors.
pub(crate) const BACKEND: &str = "cuda";

/// The engine's error for one of the driver, in a call that needed `requested` bytes.
pub(crate) fn fault(error: DriverError, requested: usize) -> Error {
    if error.0 == CUresult::CUDA_ERROR_OUT_OF_MEMORY {
        let available = result::mem_get_info().map_or(0, |(free, _)| free as u64);
        return Error::OutOfMemory { requested: requested as u64, available };
    }
    Error::DeviceLost { backend: BACKEND, reason: words(error) }
}

/// What the driver says of an error.
pub(crate) fn words(error: DriverError) -> String {
    let text = error.error_string().map(|text| text.to_string_lossy().into_owned());
    text.unwrap_or_else(|_| format!("{:?}", error.0))
}

/// Maps the error of a driver call that takes no memory.
pub(crate) trait DriverResult<T> {
    /// The engine's result.
    fn engine(self) -> cloth_core::Result<T>;
}

impl<T> DriverResult<T> for Result<T, DriverError> {
    fn engine(self) -> cloth_core::Result<T> {
        self.map_err(|error| fault(error, 0))
    }
}
