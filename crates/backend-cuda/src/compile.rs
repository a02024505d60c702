//! CUDA C++ to machine code, through NVRTC.

use std::{
    ffi::CString,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use cloth_core::{Error, FieldProgram, Precision, Result};
use cloth_kernels::CudaModule;
use cudarc::nvrtc::{result as nvrtc, sys};

use crate::{fault::BACKEND, procedural};

/// What a module is compiled for, apart from the device.
#[derive(Clone, Debug)]
pub(crate) struct Target<'a> {
    /// In double precision.
    pub(crate) double: bool,
    /// Without the promise of the same bits as the CPU.
    pub(crate) fast: bool,
    /// Options of the module.
    pub(crate) options: &'a [&'static str],
    /// The part for procedural fields of a model, if the module has one.
    pub(crate) procedural: Option<&'a str>,
}

impl Target<'_> {
    /// The options of the source that stand for this.
    pub(crate) fn defines(&self) -> Vec<&'static str> {
        let mut defines = Vec::new();
        defines.extend(self.double.then_some("f64"));
        defines.extend(self.fast.then_some("fast"));
        defines.extend(self.options);
        defines
    }

    /// What takes the place of shared parts of the source.
    pub(crate) fn parts(&self) -> Vec<(&'static str, &str)> {
        self.procedural.map(|part| (procedural::PART, part)).into_iter().collect()
    }
}

/// An expression with every operation and function of procedural fields, to compile kernels with.
const EXPRESSION: &str = "let r = length(vec3(x.x, x.y, 0)); \
    select(not (r < 1 and id >= 2 or t != 3), m * cross(x, v) / (1 + r ^ 3), \
    clamp(normalize(x), -1, 0.5) * noise(4 * x) - mix(vec3(sin(t), cos(r), exp(-dot(v, v))), v, dt) \
    + min(x, v) * log(2 + r) ^ 1.5 + max(v, 0.1) * sqrt(abs(x.z)))";

/// Which sets of the options of kernels are compiled as a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KernelSets {
    /// Every set that is used.
    All,
    /// Few sets, which have every pair of options.
    Pairs,
    /// Each module without options, in both precisions.
    Plain,
}

/// Compiles every kernel for an architecture, such as `sm_90`, as a check: needs NVRTC, but no GPU. Returns how many modules that were.
///
/// # Errors
/// [`Error::KernelCompile`] for the first that fails; [`Error::NoDevice`] if the compiler is missing.
pub fn kernels_compile(architecture: &str, sets: KernelSets) -> Result<usize> {
    let program = FieldProgram::compile(EXPRESSION)
        .map_err(|error| fail("procedural_forces", error.to_string()))?;
    let part = |precision| procedural::part_of(&[&program, &program], precision);
    let [single, double] = [part(Precision::F32), part(Precision::F64)];
    let of_module = |module: &CudaModule| match sets {
        KernelSets::All => module.option_sets(),
        KernelSets::Pairs => module.option_pairs(),
        KernelSets::Plain => {
            module.option_sets().into_iter().filter(|set| set.iter().all(|o| *o == "f64")).collect()
        }
    };
    let mut work: Vec<(_, _, Option<&str>)> = cloth_kernels::CUDA_MODULES
        .iter()
        .flat_map(|module| of_module(module).into_iter().map(move |set| (module, set, None)))
        .collect();
    // With procedural fields every option of the frame kernel need not be tried again.
    for module in cloth_kernels::CUDA_MODULES {
        let options: &[_] = match module.name {
            "explicit_substep" => &["penalty", "table", "grid"],
            "procedural_forces" => &[],
            name if name.starts_with("explicit_substep") => &[],
            _ => continue,
        };
        for (precision, part) in [(None, &single), (Some("fast"), &single), (Some("f64"), &double)]
        {
            let set = precision.into_iter().chain(options.iter().copied()).collect();
            work.push((module, set, Some(part)));
        }
    }
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((module, set, part)) = work.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let options =
                        cloth_kernels::cuda_compiler_options(architecture, set.contains(&"fast"));
                    let parts: Vec<_> =
                        part.map(|part| (procedural::PART, part)).into_iter().collect();
                    let compiled = module
                        .compose_with(set.clone(), &parts)
                        .map_err(|error| fail(module.name, error.to_string()))
                        .and_then(|source| compile(module.name, &source, &options));
                    if let Err(error) = compiled {
                        next.store(work.len(), Ordering::Relaxed);
                        failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                    }
                }
            });
        }
    });
    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(work.len()),
    }
}

fn fail(kernel: &'static str, log: String) -> Error {
    Error::KernelCompile { kernel, log }
}

/// Compiles a source text to a cubin.
///
/// # Errors
/// `KernelCompile` with the compiler's messages; `NoDevice` if the compiler is missing.
pub(crate) fn compile(name: &'static str, source: &str, options: &[String]) -> Result<Vec<u8>> {
    // SAFETY: it only tries to open the library. All other calls panic without it.
    if !unsafe { sys::is_culib_present() } {
        let reason = "NVRTC, NVIDIA's compiler for kernels, is missing: install the package \
                      cuda-nvrtc-13-0 (or `pip install nvidia-cuda-nvrtc`) and let LD_LIBRARY_PATH name the \
                      folder of libnvrtc.so.13";
        return Err(Error::NoDevice { backend: BACKEND, reason: reason.into() });
    }
    let fail = |log: String| Error::KernelCompile { kernel: name, log };
    let failed = |error: nvrtc::NvrtcError| fail(error.to_string());
    let text = CString::new(source).map_err(|error| fail(error.to_string()))?;
    let file = CString::new(format!("{name}.cu")).map_err(|error| fail(error.to_string()))?;
    let program = nvrtc::create_program(&text, Some(&file)).map_err(failed)?;
    // SAFETY: the program was just created, and is destroyed below, once.
    let compiled = unsafe { nvrtc::compile_program(program, options) };
    let image = match compiled {
        Ok(()) => cubin(program).map_err(failed),
        Err(error) => {
            // SAFETY: as above.
            let log = unsafe { nvrtc::get_program_log(program) }.unwrap_or_default();
            let log: Vec<u8> = log.iter().map(|&c| c as u8).take_while(|&c| c != 0).collect();
            Err(fail(format!("{error}\n{}", String::from_utf8_lossy(&log))))
        }
    };
    // SAFETY: as above.
    unsafe { nvrtc::destroy_program(program) }.map_err(failed)?;
    image
}

fn cubin(program: sys::nvrtcProgram) -> std::result::Result<Vec<u8>, nvrtc::NvrtcError> {
    let mut size = 0;
    // SAFETY: writes one number.
    unsafe { sys::nvrtcGetCUBINSize(program, &raw mut size) }.result()?;
    let mut image = vec![0_u8; size];
    // SAFETY: the buffer has the size that was asked for.
    unsafe { sys::nvrtcGetCUBIN(program, image.as_mut_ptr().cast()) }.result()?;
    Ok(image)
}
