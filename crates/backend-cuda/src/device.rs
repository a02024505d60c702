//! One GPU: its context, and the modules loaded into it.

use std::{
    collections::HashMap,
    ffi::CString,
    sync::{Arc, Mutex, PoisonError},
};

use cloth_core::{Error, Result};
use cudarc::driver::{
    result,
    sys::{self, CUcontext, CUdevice_attribute as Attribute, CUfunction, CUmodule},
};

use crate::{
    fault::{BACKEND, DriverResult, words},
    images::{Ahead, Images, Source},
};

/// A GPU.
pub(crate) struct Device {
    handle: sys::CUdevice,
    context: CUcontext,
    pub(crate) name: String,
    pub(crate) memory: usize,
    /// Compute capability.
    pub(crate) capability: (u32, u32),
    pub(crate) multiprocessors: u32,
    /// Bytes of shared memory that a block may have.
    pub(crate) shared_max: usize,
    pub(crate) driver: i32,
    pub(crate) images: Arc<Images>,
    pub(crate) ahead: Ahead,
    modules: Mutex<HashMap<u128, Module>>,
}

#[derive(Clone, Copy)]
struct Module(CUmodule);

/// A kernel of a loaded module.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) struct Kernel(pub(crate) CUfunction);

// SAFETY: handles of the driver may be used from any thread that has made the context current, which
// every use does.
unsafe impl Send for Module {}
// SAFETY: as above.
unsafe impl Send for Kernel {}
// SAFETY: as above; the modules are behind a lock.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

fn no_device(reason: impl Into<String>) -> Error {
    Error::NoDevice { backend: BACKEND, reason: reason.into() }
}

/// CUDA version of the driver from which on it has all functions that are called: the others panic. The number is as
/// `cuDriverGetVersion` gives it.
const DRIVER_MIN: i32 = 13_000;
/// Compute capability from which on a GPU has the instructions of the kernels.
const CAPABILITY_MIN: u32 = 8;

/// A version as `cuDriverGetVersion` gives it, for people.
pub(crate) fn version_text(version: i32) -> String {
    format!("{}.{}", version / 1000, version % 1000 / 10)
}

/// The CUDA version of the driver.
///
/// # Errors
/// `NoDevice` if it is too old.
fn driver_version() -> Result<i32> {
    let mut version = 0;
    // SAFETY: writes one integer.
    unsafe { sys::cuDriverGetVersion(&raw mut version) }
        .result()
        .map_err(|error| no_device(words(error)))?;
    driver_check(version)
}

fn driver_check(version: i32) -> Result<i32> {
    if version < DRIVER_MIN {
        return Err(no_device(format!(
            "the NVIDIA driver is for CUDA {}; install one for CUDA {} or later, or choose another backend",
            version_text(version),
            version_text(DRIVER_MIN),
        )));
    }
    Ok(version)
}

/// Number of GPUs that the driver shows.
///
/// # Errors
/// `NoDevice` without a driver, or if it is too old.
pub(crate) fn device_count() -> Result<usize> {
    // SAFETY: it only tries to open the library. All other calls panic without it.
    if !unsafe { sys::is_culib_present() } {
        return Err(no_device(
            "the NVIDIA driver (libcuda) is not installed; install it, or choose another backend",
        ));
    }
    driver_version()?;
    result::init().map_err(|error| no_device(words(error)))?;
    let count = result::device::get_count().map_err(|error| no_device(words(error)))?;
    Ok(count.max(0) as usize)
}

impl Device {
    /// GPU number `ordinal`.
    ///
    /// # Errors
    /// `NoDevice` if there is none of that number.
    pub(crate) fn open(ordinal: usize) -> Result<Arc<Self>> {
        let count = device_count()?;
        if ordinal >= count {
            let reason = format!("there is no GPU number {ordinal}: the driver shows {count}");
            return Err(no_device(reason));
        }
        let failed = |error| no_device(words(error));
        let handle = result::device::get(ordinal as i32).map_err(failed)?;
        let name = result::device::get_name(handle).map_err(failed)?;
        let attribute = |attribute| {
            // SAFETY: the handle is of a device that exists.
            unsafe { result::device::get_attribute(handle, attribute) }.map_err(failed)
        };
        let major = attribute(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR)? as u32;
        let minor = attribute(Attribute::CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR)? as u32;
        if major < CAPABILITY_MIN {
            let reason = format!(
                "{name} has compute capability {major}.{minor}; the kernels need {CAPABILITY_MIN}.0 or later; choose another backend"
            );
            return Err(no_device(reason));
        }
        let driver = driver_version()?;
        Ok(Arc::new(Self {
            name,
            // SAFETY: as above.
            memory: unsafe { result::device::total_mem(handle) }.map_err(failed)?,
            capability: (major, minor),
            multiprocessors: attribute(Attribute::CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT)? as u32,
            shared_max: attribute(Attribute::CU_DEVICE_ATTRIBUTE_MAX_SHARED_MEMORY_PER_BLOCK_OPTIN)?
                as usize,
            images: Arc::new(Images::new((major, minor), driver)),
            ahead: Ahead::default(),
            driver,
            handle,
            // Last, as what fails before has nothing to release.
            // SAFETY: as above; the context is released when this is dropped.
            context: unsafe { result::primary_ctx::retain(handle) }.map_err(failed)?,
            modules: Mutex::new(HashMap::new()),
        }))
    }

    /// Makes the context current in this thread: what every call of the driver needs.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn bind(&self) -> Result<()> {
        // SAFETY: the context lives as long as this.
        unsafe { result::ctx::set_current(self.context) }.engine()
    }

    /// The kernel `name` of a module, compiled if that was never done on this machine.
    ///
    /// # Errors
    /// `KernelCompile`, `NoDevice` without a compiler.
    pub(crate) fn kernel(&self, source: &Source, name: &'static str) -> Result<Kernel> {
        self.bind()?;
        let fail = |log: String| Error::KernelCompile { kernel: source.name, log };
        let key = self.images.key(source);
        let mut modules = self.modules.lock().unwrap_or_else(PoisonError::into_inner);
        let loaded = match modules.get(&key) {
            Some(loaded) => *loaded,
            None => {
                let loaded = self.images.with(source, |image| {
                    // SAFETY: the image is a whole cubin, and outlives the call.
                    unsafe { result::module::load_data(image.as_ptr().cast()) }
                        .map_err(|error| fail(words(error)))
                })?;
                modules.insert(key, Module(loaded));
                Module(loaded)
            }
        };
        let name = CString::new(name).map_err(|error| fail(error.to_string()))?;
        // SAFETY: the module is loaded and stays so until the device is dropped.
        let function = unsafe { result::module::get_function(loaded.0, name) }
            .map_err(|error| fail(words(error)))?;
        Ok(Kernel(function))
    }

    /// Bytes of dynamic shared memory that a block of a kernel may have.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn shared_left(&self, kernel: Kernel) -> Result<usize> {
        self.bind()?;
        let attribute = sys::CUfunction_attribute::CU_FUNC_ATTRIBUTE_SHARED_SIZE_BYTES;
        // SAFETY: the kernel belongs to a loaded module.
        let used = unsafe { result::function::get_function_attribute(kernel.0, attribute) };
        Ok(self.shared_max - used.engine()? as usize)
    }

    /// Blocks of a kernel that fit on the device at once, with so many bytes of dynamic shared memory, which the kernel
    /// may then be started with.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn resident_blocks(
        &self,
        kernel: Kernel,
        threads: u32,
        shared: usize,
    ) -> Result<u32> {
        self.bind()?;
        if shared > 0 {
            // Beyond 48 KiB the driver wants to be told. Always as much as there is, as other solvers start the
            // kernel with other sizes.
            let attribute =
                sys::CUfunction_attribute::CU_FUNC_ATTRIBUTE_MAX_DYNAMIC_SHARED_SIZE_BYTES;
            let most = self.shared_left(kernel)?;
            // SAFETY: the kernel belongs to a loaded module.
            unsafe { result::function::set_function_attribute(kernel.0, attribute, most as i32) }
                .engine()?;
        }
        // SAFETY: as above.
        let blocks = unsafe {
            result::occupancy::max_active_block_per_multiprocessor(kernel.0, threads as i32, shared)
        }
        .engine()?;
        Ok(blocks.max(1) as u32 * self.multiprocessors)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.bind().is_err() {
            return;
        }
        let modules = self.modules.get_mut().unwrap_or_else(PoisonError::into_inner);
        for module in modules.values() {
            // SAFETY: all solvers that launch its kernels hold the device, and are gone.
            let _ = unsafe { result::module::unload(module.0) };
        }
        // SAFETY: it was retained once.
        let _ = unsafe { result::primary_ctx::release(self.handle) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_that_is_too_old_is_an_error_that_names_both_versions() {
        assert_eq!(driver_check(DRIVER_MIN), Ok(DRIVER_MIN));
        let Err(Error::NoDevice { reason, .. }) = driver_check(12_090) else {
            panic!("it is too old")
        };
        assert!(reason.contains("12.9") && reason.contains("13.0"), "{reason}");
    }
}
