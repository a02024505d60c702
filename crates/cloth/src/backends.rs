//! The backends that this build has, and the choice among them.

use std::{num::NonZeroUsize, sync::Arc};

use cloth_core::{Backend, BackendInfo, Error, Model, Precision, SolverConfig};

/// One backend: a feature of this crate adds one entry to [`BACKENDS`].
struct BackendEntry {
    name: &'static str,
    create: BackendCreate,
}

/// Makes a backend.
type BackendCreate = fn(&BackendOptions) -> Result<Box<dyn Backend>, Error>;

/// In the order in which an automatic choice tries them, the fastest first.
const BACKENDS: &[BackendEntry] = &[
    #[cfg(feature = "cuda")]
    BackendEntry {
        name: "cuda",
        create: |options| {
            let adapter = options.adapter.as_deref().unwrap_or_default();
            let options = cloth_backend_cuda::CudaOptions::parse(adapter)?;
            Ok(Box::new(cloth_backend_cuda::CudaBackend::new(options)?))
        },
    },
    #[cfg(feature = "wgpu")]
    BackendEntry { name: "wgpu", create: wgpu_create },
    #[cfg(feature = "cpu")]
    BackendEntry {
        name: "cpu",
        create: |options| Ok(Box::new(cloth_backend_cpu::CpuBackend::new(options.threads)?)),
    },
    #[cfg(feature = "reference")]
    BackendEntry {
        name: REFERENCE,
        create: |_| Ok(Box::new(cloth_backend_reference::ReferenceBackend::new())),
    },
];

/// The backend to read and to compare with, which an automatic choice never takes.
const REFERENCE: &str = "reference";

/// The names of all backends that there are; each is that of a Cargo feature, too.
const NAMES: [&str; 4] = ["cuda", "wgpu", "cpu", REFERENCE];

/// The name that stands for an automatic choice.
pub const AUTO: &str = "auto";

/// What a backend can be told. Each takes what concerns it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BackendOptions {
    /// Threads of a backend that computes on the processor, or as many as the machine has.
    pub threads: Option<NonZeroUsize>,
    /// Number of a GPU, or part of its name; the best one if `None`.
    pub adapter: Option<String>,
    /// Whether to take the time of every stage where that costs speed.
    pub stage_times: bool,
}

/// A backend that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BackendError {
    /// This build has no backend of that name.
    #[error("unknown backend `{name}`; this build has: {}", available.join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
        /// All names that [`backend_create`] takes.
        available: Vec<&'static str>,
    },
    /// This build lacks a backend that there is.
    #[error(
        "the backend `{name}` is not in this build, which has: {}; the Cargo feature `{name}` adds it (the program: `cargo install \
         cloth-cli --features {name}`)",
        available.join(", ")
    )]
    Absent {
        /// The name asked for, which is that of the feature.
        name: &'static str,
        /// All names that [`backend_create`] takes.
        available: Vec<&'static str>,
    },
    /// The machine cannot run it.
    #[error(transparent)]
    Unusable(#[from] Error),
}

/// What an automatic choice came to.
pub struct BackendChoice {
    /// The backend.
    pub backend: Box<dyn Backend>,
    /// Which one it is and why, in one line.
    pub reason: String,
}

/// A backend that was asked about: its name, and what it is or why it cannot be used.
pub type BackendOutcome = (&'static str, Result<BackendInfo, Error>);

#[cfg(feature = "wgpu")]
fn wgpu_create(options: &BackendOptions) -> Result<Box<dyn Backend>, Error> {
    let options = cloth_backend_wgpu::WgpuOptions {
        adapter: options.adapter.clone(),
        stage_times: options.stage_times,
        ..cloth_backend_wgpu::WgpuOptions::default()
    };
    Ok(Box::new(cloth_backend_wgpu::WgpuBackend::with_options(&options)?))
}

/// What each backend of this build is; those that this machine cannot run are left out.
#[must_use]
pub fn backends() -> Vec<BackendInfo> {
    backends_all().into_iter().filter_map(|(_, outcome)| outcome.ok()).collect()
}

/// The backends of this build that this machine cannot run, and why.
#[must_use]
pub fn backends_missing() -> Vec<(&'static str, Error)> {
    let all = backends_all().into_iter();
    all.filter_map(|(name, outcome)| Some((name, outcome.err()?))).collect()
}

/// The backends that this build lacks; a Cargo feature of the same name adds each.
#[must_use]
pub fn backends_absent() -> Vec<&'static str> {
    let is_there = |name| BACKENDS.iter().any(|entry| entry.name == name);
    NAMES.into_iter().filter(|name| !is_there(*name)).collect()
}

fn backends_all() -> Vec<BackendOutcome> {
    let options = BackendOptions::default();
    let outcome = |entry: &BackendEntry| (entry.create)(&options).map(|b| b.info().clone());
    BACKENDS.iter().map(|entry| (entry.name, outcome(entry))).collect()
}

/// The backend called `name`, as for [`backend_open`]. One that computes on the processor uses that many
/// `threads`, or as many as the machine has; others ignore them.
///
/// # Errors
/// [`BackendError::Unknown`] with the names there are; [`BackendError::Unusable`] if this machine
/// cannot run it.
pub fn backend_create(
    name: &str,
    threads: Option<NonZeroUsize>,
) -> Result<Box<dyn Backend>, BackendError> {
    backend_open(name, &BackendOptions { threads, ..BackendOptions::default() })
}

/// The backend called `name`, with options. After the name there may be a colon and the adapter: `cuda:1` is
/// the second GPU, `cuda:fast` the first one, with arithmetic that does not repeat the bits of the CPU.
///
/// # Errors
/// Those of [`backend_create`].
pub fn backend_open(
    name: &str,
    options: &BackendOptions,
) -> Result<Box<dyn Backend>, BackendError> {
    let (known, adapter) = name.split_once(':').map_or((name, None), |(a, b)| (a, Some(b)));
    let mut options = options.clone();
    options.adapter = adapter.map(str::to_owned).or(options.adapter);
    match BACKENDS.iter().find(|entry| entry.name == known) {
        Some(entry) => Ok((entry.create)(&options)?),
        None => {
            let available = BACKENDS.iter().map(|entry| entry.name).collect();
            Err(match backends_absent().into_iter().find(|absent| *absent == known) {
                Some(name) => BackendError::Absent { name, available },
                None => BackendError::Unknown { name: name.to_owned(), available },
            })
        }
    }
}

/// Particles from which a GPU is worth its start-up and its dispatches.
const GPU_PARTICLES: usize = 5_000;

/// The fastest backend of this machine that can do all that a model and its settings ask for: a GPU for
/// all but small models, unless it is a driver that computes on the processor.
///
/// # Errors
/// [`BackendError::Unusable`] if none can: the error of the last one tried.
pub fn backend_choose(
    model: &Arc<Model>,
    config: &SolverConfig,
    options: &BackendOptions,
) -> Result<BackendChoice, BackendError> {
    let mut passed_over = Vec::new();
    let mut last = None;
    for entry in BACKENDS.iter().filter(|entry| entry.name != REFERENCE) {
        match try_entry(entry, model, config, options) {
            Ok(Ok(backend)) => {
                let mut reason = format!("{} ({})", entry.name, backend.info().device);
                if !passed_over.is_empty() {
                    reason = format!("{reason}; {}", passed_over.join("; "));
                }
                return Ok(BackendChoice { backend, reason });
            }
            Ok(Err(reason)) => passed_over.push(format!("not {}: {reason}", entry.name)),
            Err(error) => {
                passed_over.push(format!("not {}: {error}", entry.name));
                last = Some(error);
            }
        }
    }
    let none = || Error::NoDevice { backend: AUTO, reason: passed_over.join("; ") };
    Err(BackendError::Unusable(last.unwrap_or_else(none)))
}

/// A backend if it is the right one, or why it is not.
fn try_entry(
    entry: &BackendEntry,
    model: &Arc<Model>,
    config: &SolverConfig,
    options: &BackendOptions,
) -> Result<Result<Box<dyn Backend>, String>, Error> {
    let is_gpu = entry.name != "cpu";
    let particles = model.particle_count();
    // An adapter that was named is meant to be used.
    if is_gpu && particles < GPU_PARTICLES && options.adapter.is_none() && has_cpu() {
        return Ok(Err(format!("a model of {particles} particles is too small to gain from it")));
    }
    if entry.name == "wgpu" && config.precision == Precision::F64 {
        return Ok(Err("it does not support precision f64".into()));
    }
    let backend = (entry.create)(options)?;
    let computes_on_processor =
        backend.info().details.iter().any(|(name, value)| *name == "kind" && value == "processor");
    if is_gpu && computes_on_processor && options.adapter.is_none() && has_cpu() {
        let device = &backend.info().device;
        return Ok(Err(format!("its only adapter, {device}, computes on the processor")));
    }
    // Whether it can hold and compute the model is known once it tried.
    if is_gpu {
        backend.create_solver(Arc::clone(model), config)?;
    }
    Ok(Ok(backend))
}

fn has_cpu() -> bool {
    BACKENDS.iter().any(|entry| entry.name == "cpu")
}

#[cfg(all(test, feature = "cpu", feature = "scene"))]
mod tests {
    use cloth_scene::{BenchKind, CompileOptions, bench_scene};

    use super::*;

    #[test]
    fn every_listed_backend_can_be_created_by_its_name() {
        let listed = backends();
        assert!(!listed.is_empty());
        for info in listed {
            assert_eq!(backend_create(info.name, None).unwrap().info().name, info.name);
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let Err(error) = backend_create("abacus", None) else { panic!("there is no such backend") };
        let names: Vec<&str> = BACKENDS.iter().map(|entry| entry.name).collect();
        let expected = format!("unknown backend `abacus`; this build has: {}", names.join(", "));
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn a_backend_that_this_build_lacks_is_answered_with_its_feature() {
        assert!(BACKENDS.iter().all(|entry| NAMES.contains(&entry.name)));
        let absent = backends_absent();
        assert_eq!(absent.len() + BACKENDS.len(), NAMES.len());
        for name in absent {
            for asked in [name.to_owned(), format!("{name}:1")] {
                let Err(error) = backend_create(&asked, None) else { panic!("it is not there") };
                let expected = format!("the Cargo feature `{name}` adds it");
                assert!(error.to_string().contains(&expected), "{error}");
            }
        }
    }

    #[test]
    fn a_choice_says_what_it_is_and_why() {
        let scene = bench_scene(BenchKind::Hang, 8, false);
        let compiled = scene.compile(&CompileOptions::default()).unwrap();
        let options = BackendOptions::default();
        let choice = backend_choose(&compiled.model, &compiled.config, &options).unwrap();
        assert_eq!(choice.backend.info().name, "cpu");
        assert!(choice.reason.starts_with("cpu ("), "{}", choice.reason);
        if cfg!(feature = "wgpu") {
            assert!(choice.reason.contains("not wgpu: a model of 64 particles"));
        }
    }

    #[test]
    fn what_a_gpu_cannot_do_falls_back_to_the_cpu() {
        let scene = bench_scene(BenchKind::Hang, 80, false);
        let compiled = scene.compile(&CompileOptions::default()).unwrap();
        let config = SolverConfig { precision: Precision::F64, ..compiled.config.clone() };
        let options = BackendOptions { adapter: Some("0".into()), ..BackendOptions::default() };
        let choice = backend_choose(&compiled.model, &config, &options).unwrap();
        assert_eq!(choice.backend.info().name, "cpu");
        assert_eq!(choice.reason.contains("precision f64"), cfg!(feature = "wgpu"));
        let mut settings = cloth_core::ImplicitSettings::default();
        settings.linear.method = cloth_core::LinearMethod::Direct;
        let integrator = cloth_core::Integrator::Implicit(settings);
        let config = SolverConfig { integrator, ..compiled.config };
        let choice = backend_choose(&compiled.model, &config, &options).unwrap();
        assert_eq!(choice.backend.info().name, "cpu");
        assert_eq!(choice.reason.contains("the linear solver direct"), cfg!(feature = "wgpu"));
    }
}
