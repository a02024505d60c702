//! The backends under test.

use std::{
    num::NonZeroUsize,
    sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError},
};

use cloth_backend_cpu::CpuBackend;
use cloth_backend_cuda::{CudaBackend, CudaOptions};
use cloth_backend_reference::ReferenceBackend;
use cloth_backend_wgpu::{WgpuBackend, wgpu};
use cloth_core::{
    Backend, BackendInfo, Error, Kernels, LinearMethod, LinearSettings, MatrixForm, Model,
    Precision, Preconditioner, Result, Solver, SolverConfig, State,
};

use crate::{
    feature::{Feature, is_lacking_printed},
    tracked::Tracked,
    verdict::Failure,
};

/// A backend at one precision.
pub struct Candidate {
    /// Name in messages.
    pub label: String,
    /// The backend.
    pub backend: Box<dyn Backend>,
    /// The precision that it is to compute in.
    pub precision: Precision,
    /// Rounding errors that the backend may make in a single operation, in units of those of IEEE
    /// arithmetic: 1 for the CPU.
    pub rounding: f64,
    /// Only one in so many generated cases is run: a GPU driver that computes on the processor takes
    /// far longer for a small case than its arithmetic does.
    pub case_divisor: u32,
    /// What the backend does not offer, and says so when asked for it.
    pub missing: &'static [Feature],
    /// Whether a fused linear solver keeps its scalars in single precision, while those that the host
    /// computes from single stages are in double precision: the two then differ by rounding.
    pub single_scalars: bool,
    /// Held while the candidate is under test, if it can take one test at a time.
    turn: Option<&'static Mutex<()>>,
}

/// Rounding errors of WGSL in units of IEEE ones. The accuracy table of the specification (section
/// "Floating point accuracy") allows 2.5 units in the last place for a division and, for a square root,
/// those of 1 / inverseSqrt(x): 2 for the inverse root and 2.5 for the division. All other operations of
/// the kernels are correctly rounded, `fma` as one or as two of them.
pub const WGSL_ROUNDING: f64 = 4.5;

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
        let label = format!("{label} {precision}");
        Self {
            label,
            backend,
            precision,
            rounding: 1.0,
            case_divisor: 1,
            missing: &[],
            single_scalars: false,
            turn: None,
        }
    }

    /// How many of `count` steps or cases a long test does: all, or a tenth for a slow candidate.
    #[must_use]
    pub const fn work(&self, count: u32) -> u32 {
        if self.case_divisor > 1 { count.div_ceil(10) } else { count }
    }

    /// Whether the backend offers a feature; a line says so if it does not.
    #[must_use]
    pub fn offers(&self, feature: Feature) -> bool {
        let lacks = self.missing.contains(&feature);
        if lacks {
            is_lacking_printed(&self.label, feature);
        }
        !lacks
    }

    /// Whether the backend offers a linear solver with these settings; a line says so if it does not.
    #[must_use]
    pub fn offers_linear(&self, settings: &LinearSettings) -> bool {
        let direct = settings.method == LinearMethod::Direct;
        let gradient = settings.method == LinearMethod::ConjugateGradient;
        let incomplete = settings.preconditioner == Preconditioner::IncompleteCholesky;
        let schwarz = settings.preconditioner == Preconditioner::Schwarz;
        let needed = [
            (gradient && schwarz, Feature::Schwarz),
            (direct, Feature::Direct),
            (gradient && incomplete, Feature::IncompleteCholesky),
            (settings.matrix == MatrixForm::Assembled, Feature::Assembled),
        ];
        needed.into_iter().all(|(is_needed, feature)| !is_needed || self.offers(feature))
    }

    /// Whether a failure is the backend's answer that it has no such feature, and the list says the
    /// same.
    #[must_use]
    pub fn is_known_to_lack(&self, failure: &Failure) -> bool {
        let Some(text) = failure.unsupported() else { return false };
        let known = self.missing.iter().find(|feature| text.contains(feature.wording()));
        if let Some(&feature) = known {
            is_lacking_printed(&self.label, feature);
        }
        known.is_some()
    }

    /// Distance between 1 and the next larger number, times what the backend may add to it.
    #[must_use]
    pub const fn epsilon(&self) -> f64 {
        self.rounding
            * match self.precision {
                Precision::F32 => f32::EPSILON as f64,
                Precision::F64 => f64::EPSILON,
            }
    }

    /// To be held while the candidate is under test.
    #[must_use]
    pub fn turn(&self) -> Option<MutexGuard<'static, ()>> {
        self.turn.map(|turn| turn.lock().unwrap_or_else(PoisonError::into_inner))
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

/// The first NVIDIA GPU, or `None`, said for each test that asks for it, on a machine without one. With `CLOTH_REQUIRE_CUDA=1`
/// that is a failure.
///
/// # Panics
/// If it is required and cannot be had.
#[must_use]
pub fn cuda(options: CudaOptions) -> Option<CudaBackend> {
    CudaBackend::new(options).map_err(|error| cuda_missing(&error)).ok()
}

/// Says that the test of this thread has no CUDA.
///
/// # Panics
/// If it is required.
fn cuda_missing(error: &Error) {
    let is_required = std::env::var_os("CLOTH_REQUIRE_CUDA").is_some_and(|value| value == "1");
    assert!(!is_required, "the CUDA backend cannot be tested: {error}");
    // Threads of tests have their names.
    let thread = std::thread::current();
    let test = thread.name().map_or_else(String::new, |name| format!(", {name}"));
    println!("not run here: cuda{test}: {error}");
}

/// The GPU of this machine, or the driver that computes on the processor: one device for all tests of
/// a process.
///
/// # Panics
/// If there is none, or if it is reached through OpenGL, which lacks what the kernels need.
#[must_use]
pub fn gpu() -> &'static WgpuBackend {
    static GPU: LazyLock<WgpuBackend> = LazyLock::new(|| match WgpuBackend::new(None) {
        Ok(backend) => backend,
        Err(error) => panic!("the wgpu backend cannot be tested: {error}"),
    });
    assert_ne!(GPU.interface(), wgpu::Backend::Gl, "OpenGL was taken without being asked for");
    #[cfg(target_os = "linux")]
    assert_eq!(GPU.interface(), wgpu::Backend::Vulkan);
    &GPU
}

/// The shared GPU as a backend of its own.
pub struct SharedGpu;

impl Backend for SharedGpu {
    fn info(&self) -> &BackendInfo {
        gpu().info()
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        gpu().create_solver(model, config)
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        gpu().create_kernels(model, config)
    }
}

/// A candidate for a backend that computes on the GPU.
#[must_use]
pub fn gpu_candidate(label: &str, backend: Box<dyn Backend>) -> Candidate {
    static TURN: Mutex<()> = Mutex::new(());
    Candidate {
        rounding: WGSL_ROUNDING,
        case_divisor: if gpu().is_processor() { 8 } else { 1 },
        missing: &[
            Feature::Direct,
            Feature::IncompleteCholesky,
            Feature::Assembled,
            Feature::Factorisation,
            Feature::DenseInverse,
        ],
        single_scalars: true,
        turn: Some(&TURN),
        ..Candidate::new(label, backend, Precision::F32)
    }
}

/// What the CUDA backend does not offer.
const CUDA_MISSING: &[Feature] = &[
    Feature::Direct,
    Feature::IncompleteCholesky,
    Feature::Assembled,
    Feature::Factorisation,
    Feature::DenseInverse,
];

/// The first NVIDIA GPU, shared by all tests of a process.
#[derive(Clone, Copy)]
pub struct SharedCuda(&'static CudaBackend);

impl SharedCuda {
    /// As [`cuda`] with the default options.
    #[must_use]
    pub fn new() -> Option<Self> {
        static CUDA: LazyLock<Result<CudaBackend>> =
            LazyLock::new(|| CudaBackend::new(CudaOptions::default()));
        CUDA.as_ref().map_err(cuda_missing).ok().map(Self)
    }
}

impl Backend for SharedCuda {
    fn info(&self) -> &BackendInfo {
        self.0.info()
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        self.0.create_solver(model, config)
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        self.0.create_kernels(model, config)
    }
}

/// A candidate for a backend that computes through CUDA.
#[must_use]
pub fn cuda_candidate(label: &str, backend: Box<dyn Backend>, precision: Precision) -> Candidate {
    Candidate { missing: CUDA_MISSING, ..Candidate::new(label, backend, precision) }
}

/// Whether `CLOTH_LEAVE_OUT` names a backend: a machine for one kind of GPU may lack what another needs.
#[must_use]
pub fn is_left_out(name: &str) -> bool {
    std::env::var("CLOTH_LEAVE_OUT").is_ok_and(|names| names.split(',').any(|entry| entry == name))
}

/// The reference backend, which trajectories and frames are compared with.
#[must_use]
pub fn reference() -> &'static Candidate {
    static REFERENCE: LazyLock<Candidate> = LazyLock::new(reference_candidate);
    &REFERENCE
}

/// A candidate for the reference backend. Its stages are those that the checks use: what is to be seen of it are whole runs.
fn reference_candidate() -> Candidate {
    Candidate {
        missing: &[Feature::IncompleteCholesky, Feature::DenseInverse],
        ..Candidate::new("reference", Box::new(ReferenceBackend::new()), Precision::F64)
    }
}

/// The candidates that offer a feature; a line for each of the others.
pub fn candidates_with(feature: Feature) -> impl Iterator<Item = &'static Candidate> {
    candidates().iter().filter(move |candidate| candidate.offers(feature))
}

/// Every backend that this build has, at every precision. A new backend is added here, and every
/// test of the package then runs on it.
#[must_use]
pub fn candidates() -> &'static [Candidate] {
    static CANDIDATES: LazyLock<Vec<Candidate>> = LazyLock::new(|| {
        let mut candidates = vec![
            Candidate::new("cpu", Box::new(cpu(2)), Precision::F64),
            Candidate::new("cpu", Box::new(cpu(2)), Precision::F32),
            reference_candidate(),
        ];
        for precision in [Precision::F64, Precision::F32] {
            let backend = SharedCuda::new();
            candidates.extend(
                backend.map(|backend| cuda_candidate("cuda", Box::new(backend), precision)),
            );
        }
        if is_left_out("wgpu") {
            println!("not run here: wgpu: CLOTH_LEAVE_OUT leaves it out");
        } else {
            candidates.push(gpu_candidate("wgpu", Box::new(SharedGpu)));
        }
        candidates
    });
    &CANDIDATES
}
