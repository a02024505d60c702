//! The backends under test.

use std::{num::NonZeroUsize, sync::LazyLock};

use cloth_backend_cpu::CpuBackend;
use cloth_backend_cuda::{CudaBackend, CudaOptions};
use cloth_core::{Backend, Precision, State};

use crate::tracked::Tracked;

/// A backend at one precision.
pub struct Candidate {
    /// Name in messages.
    pub label: String,
    /// The backend.
    pub backend: Box<dyn Backend>,
    /// The precision that it is to compute in.
    pub precision: Precision,
}

/// Rounding errors allowed, in units of the bound that a [`Tracked`] number carries.
///
/// The bound counts eps for each operation, twice the largest rounding error of a single one, eps/2.
/// It is of first order and holds for the order of operations of NUMERICS.md. A factor of two is
/// spent on the second order and on the rounding of the expected value itself, when it is computed
/// in the precision under test; another two on factors that a backend multiplies in advance, such
/// as h w or k/L, which adds roundings, at most one for each factor.
pub const SAFETY: f64 = 4.0;

impl Candidate {
    /// A candidate.
    #[must_use]
    pub fn new(label: &str, backend: Box<dyn Backend>, precision: Precision) -> Self {
        Self { label: format!("{label} {precision}"), backend, precision }
    }

    /// Distance between 1 and the next larger number.
    #[must_use]
    pub const fn epsilon(&self) -> f64 {
        match self.precision {
            Precision::F32 => f32::EPSILON as f64,
            Precision::F64 => f64::EPSILON,
        }
    }

    /// How far a correctly computed number can be from `expected`.
    #[must_use]
    pub fn tolerance(&self, expected: Tracked) -> f64 {
        // Below the smallest normal number rounding is absolute, not relative.
        let smallest = match self.precision {
            Precision::F32 => f64::from(f32::MIN_POSITIVE),
            Precision::F64 => f64::MIN_POSITIVE,
        };
        SAFETY * (self.epsilon() * expected.error + smallest)
    }

    /// The state with every number rounded to the precision, so that the candidate and the plain
    /// loops start from the same numbers.
    #[must_use]
    pub fn rounded(&self, state: &State) -> State {
        let mut state = state.clone();
        if self.precision == Precision::F32 {
            for vector in state.positions.iter_mut().chain(&mut state.velocities) {
                *vector = vector.map(|value| f64::from(value as f32));
            }
        }
        state
    }
}

/// A CPU backend with this many threads.
///
/// # Panics
/// If it cannot be made.
#[must_use]
pub fn cpu(threads: usize) -> CpuBackend {
    match CpuBackend::new(NonZeroUsize::new(threads)) {
        Ok(backend) => backend,
        Err(error) => panic!("the CPU backend with {threads} threads: {error}"),
    }
}

/// The first NVIDIA GPU, or `None`, said once, on a machine without one. With `CLOTH_REQUIRE_CUDA=1` that is
/// a failure.
///
/// # Panics
/// If it is required and cannot be had.
#[must_use]
pub fn cuda(options: CudaOptions) -> Option<CudaBackend> {
    match CudaBackend::new(options) {
        Ok(backend) => Some(backend),
        Err(error) if std::env::var_os("CLOTH_REQUIRE_CUDA").is_some_and(|value| value == "1") => {
            panic!("the CUDA backend cannot be tested: {error}")
        }
        Err(error) => {
            static SAID: std::sync::Once = std::sync::Once::new();
            SAID.call_once(|| eprintln!("cuda: not run here: {error}"));
            None
        }
    }
}

/// The reference that trajectories are compared with: the CPU backend in double precision.
#[must_use]
pub fn reference() -> &'static Candidate {
    &candidates()[0]
}

/// Every backend that this build has, at every precision. A new backend is added here, and every
/// test of the package then runs on it.
#[must_use]
pub fn candidates() -> &'static [Candidate] {
    static CANDIDATES: LazyLock<Vec<Candidate>> = LazyLock::new(|| {
        let mut candidates = vec![
            Candidate::new("cpu", Box::new(cpu(2)), Precision::F64),
            Candidate::new("cpu", Box::new(cpu(2)), Precision::F32),
        ];
        for precision in [Precision::F64, Precision::F32] {
            let backend = cuda(CudaOptions::default());
            candidates.extend(
                backend.map(|backend| Candidate::new("cuda", Box::new(backend), precision)),
            );
        }
        candidates
    });
    &CANDIDATES
}
