//! Machine code of modules, kept on disk. Each is compiled once, by the thread that asks first; what a solver will ask for is compiled by
//! other threads while it is made.

use std::{
    collections::HashMap,
    fs,
    hash::Hash,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread::{self, JoinHandle},
};

use cloth_core::{Error, Result};
use cloth_kernels::CudaModule;
use siphasher::sip128::{Hasher128, SipHasher13};

use crate::compile::{self, Target};

/// The text of a module, and how it is compiled.
pub(crate) struct Source {
    pub(crate) name: &'static str,
    text: String,
    fast: bool,
}

impl Source {
    /// A module for this target.
    ///
    /// # Errors
    /// `KernelCompile` for an option that the module does not know.
    pub(crate) fn new(module: &CudaModule, target: &Target<'_>) -> Result<Self> {
        let text = module.compose_with(target.defines(), &target.parts()).map_err(|error| {
            Error::KernelCompile { kernel: module.name, log: error.to_string() }
        })?;
        Ok(Self { name: module.name, text, fast: target.fast })
    }
}

/// Machine code, or why there is none; empty while it is compiled, for which whoever asks for it waits.
type Image = Arc<OnceLock<Result<Vec<u8>>>>;

/// The machine code of modules for one kind of device.
pub(crate) struct Images {
    architecture: String,
    driver: i32,
    made: Mutex<HashMap<u128, Image>>,
}

impl Images {
    /// For a device of this compute capability and this version of the driver.
    pub(crate) fn new((major, minor): (u32, u32), driver: i32) -> Self {
        Self { architecture: format!("sm_{major}{minor}"), driver, made: Mutex::default() }
    }

    fn options(&self, source: &Source) -> Vec<String> {
        cloth_kernels::cuda_compiler_options(&self.architecture, source.fast)
    }

    /// What tells a module from all others.
    pub(crate) fn key(&self, source: &Source) -> u128 {
        let mut hasher = SipHasher13::new();
        (&source.text, self.options(source), self.driver).hash(&mut hasher);
        hasher.finish128().as_u128()
    }

    /// Does something with the machine code of a module: from the disk, or compiled now.
    ///
    /// # Errors
    /// `KernelCompile` with the compiler's messages; `NoDevice` if the compiler is missing.
    pub(crate) fn with<R>(
        &self,
        source: &Source,
        work: impl FnOnce(&[u8]) -> Result<R>,
    ) -> Result<R> {
        let key = self.key(source);
        let made = Arc::clone(
            self.made.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default(),
        );
        match made.get_or_init(|| self.make(source, key)) {
            Ok(image) => work(image),
            Err(error) => Err(error.clone()),
        }
    }

    fn make(&self, source: &Source, key: u128) -> Result<Vec<u8>> {
        let path = cache_path(source, key);
        if let Some(image) = path.as_ref().and_then(|path| fs::read(path).ok())
            && !image.is_empty()
        {
            return Ok(image);
        }
        let image = compile::compile(source.name, &source.text, &self.options(source))?;
        if let Some(path) = path {
            store(&path, &image);
        }
        Ok(image)
    }

    /// Compiles a module that will be asked for, unless it is on the disk. An error waits for who asks.
    fn prepare(&self, source: &Source) {
        if cache_path(source, self.key(source)).is_none_or(|path| !path.exists()) {
            let _ = self.with(source, |_| Ok(()));
        }
    }
}

/// Threads that compile at most.
const THREADS_MAX: usize = 8;

/// Threads that compile modules ahead, for solvers of a device one after the other: what one has asked for is likely to be used by the next.
#[derive(Default)]
pub(crate) struct Ahead(Mutex<Vec<Compiling>>);

/// Threads that compile some modules.
struct Compiling {
    next: Arc<AtomicUsize>,
    threads: Vec<JoinHandle<()>>,
}

impl Ahead {
    /// Compiles these modules, the first ones first, by all processors but one: this thread needs it.
    pub(crate) fn start(&self, images: &Arc<Images>, sources: Vec<Source>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|compiling| !compiling.threads.iter().all(JoinHandle::is_finished));
        all.push(Compiling::start(images, sources));
    }
}

impl Compiling {
    fn start(images: &Arc<Images>, sources: Vec<Source>) -> Self {
        let processors = thread::available_parallelism().map_or(1, usize::from);
        let count = (processors - 1).min(sources.len()).min(THREADS_MAX);
        let sources = Arc::new(sources);
        let next = Arc::new(AtomicUsize::new(0));
        let start = |_| {
            let (images, sources, next) =
                (Arc::clone(images), Arc::clone(&sources), Arc::clone(&next));
            thread::spawn(move || {
                while let Some(source) = sources.get(next.fetch_add(1, Ordering::Relaxed)) {
                    images.prepare(source);
                }
            })
        };
        let threads = (0..count).map(start).collect();
        Self { next, threads }
    }
}

impl Drop for Compiling {
    /// Waits: no thread may be inside the compiler when the program ends.
    fn drop(&mut self) {
        // Far beyond the last one, and far from where numbers end.
        self.next.store(usize::MAX / 2, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // One that has panicked has compiled nothing: whoever needs it compiles it.
            let _ = thread.join();
        }
    }
}

/// Where the machine code of a module is kept, if anywhere.
fn cache_path(source: &Source, key: u128) -> Option<PathBuf> {
    cache_folder().map(|folder| folder.join(format!("{}-{key:032x}.cubin", source.name)))
}

/// Where compiled kernels are kept: `CLOTH_CACHE_DIR`, or a folder of the user's cache.
fn cache_folder() -> Option<PathBuf> {
    let given = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    given("CLOTH_CACHE_DIR")
        .or_else(|| given("XDG_CACHE_HOME").map(|folder| folder.join("cloth")))
        .or_else(|| given("HOME").map(|folder| folder.join(".cache/cloth")))
        .or_else(|| given("LOCALAPPDATA").map(|folder| folder.join("cloth")))
}

/// Keeps an image. A cache that cannot be written costs time, nothing else.
fn store(path: &Path, image: &[u8]) {
    let Some(folder) = path.parent() else { return };
    let partial = path.with_extension(format!("{}.part", std::process::id()));
    let stored = fs::create_dir_all(folder)
        .and_then(|()| fs::write(&partial, image))
        // Renaming is atomic: no other process sees half an image.
        .and_then(|()| fs::rename(&partial, path));
    if stored.is_err() {
        let _ = fs::remove_file(&partial);
    }
}
