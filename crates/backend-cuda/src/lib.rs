//! CUDA backend.
//!
//! Each stage of NUMERICS is a CUDA C++ kernel of its name in the package `cloth-kernels`, compiled for the
//! device when it is first used and kept on disk. The state stays in device memory. A frame of the explicit
//! integrator is one launch, in which blocks wait for their neighbours between substeps, or for all others where cloth
//! touches cloth; `forms.rs` is the table of its forms.
//!
//! Unless [`CudaOptions::fast`] is set, arithmetic is that of the CPU backend, operation for operation, each
//! rounded once: in the same precision both give the same bits.
//!
//! It builds without a CUDA toolkit: the driver and the compiler NVRTC are opened when they are needed.

mod chain;
mod compile;
mod device;
mod fault;
mod foreseen;
mod forms;
mod frame;
mod images;
mod kernel_cache;
mod kernels;
mod layout;
mod linear;
mod measure;
mod memory;
mod patch;
mod procedural;
mod queue;
mod schwarz;
mod solver_form;
mod tables;
mod timing;
mod triangle_contact;

/// How it works, with the table of its forms.
pub mod how_it_works {
    #![doc = include_str!("../BACKEND.md")]
}

use std::sync::Arc;

use cloth_core::{
    Backend, BackendInfo, Error, FormChoice, Integrator, Kernels, Model, ModelFeatures, Precision,
    Result, Solver, SolverConfig, stepper::SteppedSolver,
};

pub use compile::{KernelSets, kernels_compile};

use device::Device;
use fault::BACKEND;
use forms::FrameForm;
use kernels::CudaKernels;
use tables::SpringTables;

/// A GPU.
#[derive(Clone)]
pub struct CudaBackend {
    info: BackendInfo,
    device: Arc<Device>,
    options: CudaOptions,
}

/// How to use a GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CudaOptions {
    /// Number of the GPU.
    pub device: usize,
    /// Fused multiply-adds and approximate division and square root. Runs repeat themselves bit for bit, but
    /// their bits are not those of the CPU.
    pub fast: bool,
    /// Whether regular patches are looked for, whose springs need no indices. Off, to see what that gains.
    pub patches: bool,
}

impl Default for CudaOptions {
    fn default() -> Self {
        Self { device: 0, fast: false, patches: true }
    }
}

impl CudaOptions {
    /// Reads what follows `cuda:` in the name of a backend: the number of the GPU, `fast`, or both with a
    /// colon between.
    ///
    /// # Errors
    /// `NoDevice` if it is neither.
    pub fn parse(text: &str) -> Result<Self> {
        let mut options = Self::default();
        for part in text.split(':').filter(|part| !part.is_empty()) {
            match (part, part.parse()) {
                ("fast", _) => options.fast = true,
                (_, Ok(device)) => options.device = device,
                _ => {
                    let reason = format!(
                        "`{part}` is not the number of a GPU; write cuda, cuda:1, cuda:fast or cuda:1:fast"
                    );
                    return Err(Error::NoDevice { backend: BACKEND, reason });
                }
            }
        }
        Ok(options)
    }
}

impl CudaBackend {
    /// The GPU that the options name.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a driver or GPU, or if it is too old.
    pub fn new(options: CudaOptions) -> Result<Self> {
        let device = Device::open(options.device)?;
        let (major, minor) = device.capability;
        let arithmetic = if options.fast { "fast" } else { "reproducible" };
        let driver = format!("CUDA {}", device::version_text(device.driver));
        let details = vec![
            ("compute capability", format!("{major}.{minor}")),
            ("multiprocessors", device.multiprocessors.to_string()),
            ("memory", format!("{} MiB", device.memory >> 20)),
            ("driver", driver),
            ("arithmetic", arithmetic.to_owned()),
        ];
        let info = BackendInfo {
            name: BACKEND,
            device: device.name.clone(),
            precisions: vec![Precision::F32, Precision::F64],
            details,
        };
        Ok(Self { info, device, options })
    }

    fn kernels<T: layout::CudaReal>(
        &self,
        model: Arc<Model>,
        config: &SolverConfig,
    ) -> Result<CudaKernels<T>> {
        model.check_integrator(config, BACKEND)?;
        CudaKernels::new(Arc::clone(&self.device), model, config, self.options)
    }
}

impl Backend for CudaBackend {
    fn info(&self) -> &BackendInfo {
        &self.info
    }

    fn share(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(self.clone()))
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        Ok(match config.precision {
            Precision::F32 => Box::new(SteppedSolver::new(self.kernels::<f32>(model, config)?)?),
            Precision::F64 => Box::new(SteppedSolver::new(self.kernels::<f64>(model, config)?)?),
        })
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        Ok(match config.precision {
            Precision::F32 => Box::new(self.kernels::<f32>(model, config)?),
            Precision::F64 => Box::new(self.kernels::<f64>(model, config)?),
        })
    }

    fn forms(&self, model: &Model, config: &SolverConfig) -> Vec<FormChoice> {
        // With contact of triangles the host decides in each substep.
        if config.integrator != Integrator::Explicit || model.has_triangle_contact() {
            return Vec::new();
        }
        let device = self.device.multiprocessors as usize;
        let patches = self.options.patches;
        let sizes = match config.precision {
            Precision::F32 => {
                frame::sizes(model, &SpringTables::<f32>::new(model, patches), device)
            }
            Precision::F64 => {
                frame::sizes(model, &SpringTables::<f64>::new(model, patches), device)
            }
        };
        vec![FrameForm::choice(ModelFeatures::new(model, config).set(), &sizes)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_can_have_a_number_and_a_mode() {
        let options = |device, fast| CudaOptions { device, fast, ..CudaOptions::default() };
        assert_eq!(CudaOptions::parse(""), Ok(options(0, false)));
        assert_eq!(CudaOptions::parse("2"), Ok(options(2, false)));
        assert_eq!(CudaOptions::parse("fast"), Ok(options(0, true)));
        assert_eq!(CudaOptions::parse("1:fast"), Ok(options(1, true)));
        assert!(CudaOptions::parse("best").is_err());
    }

    #[test]
    fn a_machine_without_a_driver_or_gpu_gets_an_error() {
        match CudaBackend::new(CudaOptions { device: 4096, ..CudaOptions::default() }) {
            Err(Error::NoDevice { backend, .. }) => assert_eq!(backend, BACKEND),
            Err(error) => panic!("{error}"),
            Ok(_) => panic!("there are not that many"),
        }
    }
}
