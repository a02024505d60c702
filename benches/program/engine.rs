//! The backends, and what the memory of their devices can do.

use std::sync::Arc;

use cloth::cuda::{CudaBackend, CudaOptions};
use cloth::{Backend, Error, wgpu::WgpuBackend, wgpu::WgpuOptions};
use cloth_benches::{copy_rate_cpu, copy_rate_cuda, copy_rate_wgpu};
use cudarc::driver::CudaContext;

use crate::{arguments::BackendName, record::EngineFacts};

/// A backend with all that the program wants of it beyond the contract.
pub(crate) struct Engine {
    name: &'static str,
    kind: Kind,
    /// [`EngineFacts::copy_rate`].
    copy_rate: f64,
}

/// Which run has times of stages by the clock of the device.
pub(crate) enum DeviceClock<'a> {
    None,
    EveryRun,
    /// One of its own, on this backend.
    SecondRun(&'a dyn Backend),
}

enum Kind {
    Cpu(Box<dyn Backend>),
    /// The second one takes the times of stages, and waits for them after each frame.
    Wgpu(Box<WgpuBackend>, Box<WgpuBackend>),
    Cuda(Box<CudaBackend>, Arc<CudaContext>),
}

impl Engine {
    /// Opens a backend of this machine.
    ///
    /// # Errors
    /// Why it cannot be used here.
    pub(crate) fn open(name: BackendName, adapter: Option<&str>) -> Result<Self, String> {
        let (kind, copy_rate) = match name {
            BackendName::Cpu => {
                let backend = cloth::backend_create("cpu", None).map_err(|e| e.to_string())?;
                (Kind::Cpu(backend), copy_rate_cpu())
            }
            BackendName::Wgpu => {
                let backend = WgpuBackend::new(adapter).map_err(|e| e.to_string())?;
                let timed = WgpuBackend::with_options(&WgpuOptions {
                    adapter: adapter.map(str::to_owned),
                    stage_times: true,
                    ..WgpuOptions::default()
                });
                let timed = timed.map_err(|e| e.to_string())?;
                let rate = copy_rate_wgpu(&backend)?;
                (Kind::Wgpu(Box::new(backend), Box::new(timed)), rate)
            }
            BackendName::Cuda => {
                let backend =
                    CudaBackend::new(CudaOptions::default()).map_err(|e| e.to_string())?;
                let context = CudaContext::new(0).map_err(|e| e.to_string())?;
                let rate = copy_rate_cuda(&context).map_err(|e| e.to_string())?;
                (Kind::Cuda(Box::new(backend), context), rate)
            }
        };
        Ok(Self { name: name.name(), kind, copy_rate })
    }

    pub(crate) const fn name(&self) -> &'static str {
        self.name
    }

    pub(crate) fn backend(&self) -> &dyn Backend {
        match &self.kind {
            Kind::Cpu(backend) => &**backend,
            Kind::Wgpu(backend, _) => &**backend,
            Kind::Cuda(backend, _) => &**backend,
        }
    }

    /// Who has times of stages by the clock of the device.
    pub(crate) fn device_clock(&self) -> DeviceClock<'_> {
        match &self.kind {
            Kind::Cpu(_) => DeviceClock::None,
            Kind::Wgpu(_, timed) => DeviceClock::SecondRun(&**timed),
            Kind::Cuda(..) => DeviceClock::EveryRun,
        }
    }

    /// Whether frames can be started before those before are done.
    pub(crate) const fn is_asynchronous(&self) -> bool {
        !matches!(self.kind, Kind::Cpu(_))
    }

    /// Whether it is a GPU that the processor plays: good for checks, not for times.
    pub(crate) fn is_emulated(&self) -> bool {
        matches!(&self.kind, Kind::Wgpu(backend, _) if backend.is_processor())
    }

    /// Bytes of the device's memory in use, where that can be known.
    pub(crate) fn memory_used(&self) -> Option<u64> {
        match &self.kind {
            Kind::Cpu(_) => None,
            Kind::Wgpu(backend, _) => {
                Some(backend.device().generate_allocator_report()?.total_allocated_bytes)
            }
            Kind::Cuda(_, context) => {
                let (free, total) = context.mem_get_info().ok()?;
                Some((total - free) as u64)
            }
        }
    }

    pub(crate) fn facts(&self) -> EngineFacts {
        let info = self.backend().info();
        EngineFacts {
            backend: self.name.into(),
            device: info.device.clone(),
            details: info.details.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect(),
            copy_rate: self.copy_rate,
        }
    }
}

/// The engines of a run, those that have been lost left out.
pub(crate) struct Engines {
    pub(crate) all: Vec<Engine>,
    lost: Vec<&'static str>,
}

impl Engines {
    pub(crate) const fn new(all: Vec<Engine>) -> Self {
        Self { all, lost: Vec::new() }
    }

    /// Those that still answer.
    pub(crate) fn present(&self) -> impl Iterator<Item = &Engine> {
        self.all.iter().filter(|engine| !self.lost.contains(&engine.name))
    }

    /// Whether its device went away.
    pub(crate) fn is_lost(&self, name: &str) -> bool {
        self.lost.contains(&name)
    }

    /// Takes note of an error: an engine whose device is lost is not asked again.
    pub(crate) fn report(&mut self, name: &'static str, error: &Error) {
        if matches!(error, Error::DeviceLost { .. }) {
            self.lost.push(name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_lost_device_is_not_asked_again() {
        let engine = Engine::open(BackendName::Cpu, None).unwrap();
        let mut engines = Engines::new(vec![engine]);
        let unsupported = Error::Unsupported { backend: "cpu", feature: "it".into() };
        engines.report("cpu", &unsupported);
        assert!(!engines.is_lost("cpu") && engines.present().count() == 1);
        let lost = Error::DeviceLost { backend: "cpu", reason: "it fell".into() };
        engines.report("cpu", &lost);
        assert!(engines.is_lost("cpu") && engines.present().count() == 0);
    }
}
