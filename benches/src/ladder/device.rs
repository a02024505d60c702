//! A GPU as the rungs below the product use it: its kernels, its memory and its clock.

use std::sync::Arc;

use cloth::{Error, Result};
use cudarc::driver::{
    CudaContext, CudaEvent, CudaFunction, CudaModule, CudaSlice, CudaStream, DeviceRepr,
    DriverError, LaunchArgs, LaunchConfig,
    sys::{CUevent_flags, CUresult},
};

use super::compile::{BINS, CONSTANTS, MATH, NAIVE, Source};

/// Threads of a block.
const THREADS: u32 = 256;

/// A GPU.
pub(super) struct Device {
    pub(super) stream: Arc<CudaStream>,
    pub(super) kernels: Kernels,
}

/// The kernels of all rungs.
pub(super) struct Kernels {
    /// Substeps.
    pub(super) naive: CudaFunction,
    pub(super) constants: CudaFunction,
    pub(super) math: CudaFunction,
    pub(super) bins: CudaFunction,
    /// What fills bins before those of the last.
    pub(super) bins_place: CudaFunction,
    pub(super) bins_fill: CudaFunction,
    pub(super) bins_refill: CudaFunction,
}

impl Kernels {
    fn load(context: &Arc<CudaContext>) -> Result<Self> {
        let capability = context.compute_capability().map_err(|error| fault(context, error, 0))?;
        let architecture = format!("sm_{}{}", capability.0, capability.1);
        let module = |source: Source| -> Result<Arc<CudaModule>> {
            let code = source.compile(&architecture)?;
            context.load_module(code).map_err(|error| source.failed(words(error)))
        };
        let kernel = |source: Source, module: &Arc<CudaModule>, name| {
            module.load_function(name).map_err(|error| source.failed(words(error)))
        };
        let step = |source| kernel(source, &module(source)?, "step");
        let bins = module(BINS)?;
        Ok(Self {
            naive: step(NAIVE)?,
            constants: step(CONSTANTS)?,
            math: step(MATH)?,
            bins: kernel(BINS, &bins, "step")?,
            bins_place: kernel(BINS, &bins, "bins_place")?,
            bins_fill: kernel(BINS, &bins, "bins_fill")?,
            bins_refill: kernel(BINS, &bins, "bins_refill")?,
        })
    }
}

impl Device {
    /// GPU number `ordinal`, of which a backend has found that it is there.
    ///
    /// # Errors
    /// Those of [`Source::compile`], and what the device reports.
    pub(super) fn open(ordinal: usize) -> Result<Self> {
        let context = CudaContext::new(ordinal)
            .map_err(|error| Error::NoDevice { backend: "cuda", reason: words(error) })?;
        // With a stream of its own `cudarc` would put events around all that is started, and these would be measured as well.
        let stream = context.default_stream();
        Ok(Self { kernels: Kernels::load(&context)?, stream })
    }

    /// The engine's result of what needed so many bytes.
    fn result<T>(&self, result: std::result::Result<T, DriverError>, bytes: usize) -> Result<T> {
        result.map_err(|error| fault(self.stream.context(), error, bytes))
    }

    /// An array of zeros.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(super) fn zeros(&self, length: usize) -> Result<CudaSlice<u32>> {
        self.result(self.stream.alloc_zeros(length), length * size_of::<u32>())
    }

    /// An array with these entries.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub(super) fn array<T: DeviceRepr>(&self, entries: &[T]) -> Result<CudaSlice<T>> {
        self.result(self.stream.clone_htod(entries), size_of_val(entries))
    }

    /// Waits for all work and reads an array.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(super) fn read<T: DeviceRepr>(&self, array: &CudaSlice<T>) -> Result<Vec<T>> {
        let entries = self.result(self.stream.clone_dtoh(array), 0)?;
        self.result(self.stream.synchronize(), 0)?;
        Ok(entries)
    }

    /// Copies an array over another one of its length.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(super) fn copy<T>(&self, from: &CudaSlice<T>, to: &mut CudaSlice<T>) -> Result<()> {
        self.result(self.stream.memcpy_dtod(from, to), 0)
    }

    /// Marks the time at which all work until now is done.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(super) fn mark(&self) -> Result<CudaEvent> {
        self.result(self.stream.record_event(Some(CUevent_flags::CU_EVENT_DEFAULT)), 0)
    }

    /// Waits for the work between two marks; its time \[s\].
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(super) fn seconds(&self, start: &CudaEvent, end: &CudaEvent) -> Result<f64> {
        Ok(f64::from(self.result(start.elapsed_ms(end), 0)?) * 1e-3)
    }

    /// Starts a kernel with these arguments, one thread for each of `items`.
    ///
    /// # Errors
    /// `DeviceLost`.
    #[expect(
        unsafe_code,
        reason = "nobody but the caller knows what a kernel does with its arguments"
    )]
    pub(super) fn launch(&self, arguments: &mut LaunchArgs<'_>, items: usize) -> Result<()> {
        let blocks = (items as u32).div_ceil(THREADS).max(1);
        let config = LaunchConfig {
            grid_dim: (blocks, 1, 1),
            block_dim: (THREADS, 1, 1),
            shared_mem_bytes: 0,
        };
        // SAFETY: each caller gives the arguments of its kernel. The kernels write within their arrays, all of which are of one
        // stream, so that none is freed before what was started is done with it.
        self.result(unsafe { arguments.launch(config) }, 0)?;
        Ok(())
    }
}

/// The engine's error for one of the driver, in a call that needed so many bytes.
fn fault(context: &CudaContext, error: DriverError, bytes: usize) -> Error {
    if error.0 == CUresult::CUDA_ERROR_OUT_OF_MEMORY {
        let available = context.mem_get_info().map_or(0, |(free, _)| free as u64);
        return Error::OutOfMemory { requested: bytes as u64, available };
    }
    Error::DeviceLost { backend: "cuda", reason: words(error) }
}

/// What the driver says of an error.
fn words(error: DriverError) -> String {
    let text = error.error_string().map(|text| text.to_string_lossy().into_owned());
    text.unwrap_or_else(|_| format!("{:?}", error.0))
}
