//! The backends that this build has.

use std::num::NonZeroUsize;

use cloth_core::{Backend, BackendInfo, Error};

/// One backend: a feature of this crate adds one line to [`BACKENDS`].
struct BackendEntry {
    name: &'static str,
    create: BackendCreate,
}

/// Makes a backend from what follows its name and a colon, with that many threads if it has any.
type BackendCreate = fn(&str, Option<NonZeroUsize>) -> Result<Box<dyn Backend>, Error>;

const BACKENDS: &[BackendEntry] = &[
    #[cfg(feature = "cpu")]
    BackendEntry {
        name: "cpu",
        create: |_, threads| Ok(Box::new(cloth_backend_cpu::CpuBackend::new(threads)?)),
    },
    #[cfg(feature = "cuda")]
    BackendEntry {
        name: "cuda",
        create: |options, _| {
            let options = cloth_backend_cuda::CudaOptions::parse(options)?;
            Ok(Box::new(cloth_backend_cuda::CudaBackend::new(options)?))
        },
    },
];

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
    /// The machine cannot run it.
    #[error(transparent)]
    Unusable(#[from] Error),
}

/// What each backend of this build is; those that this machine cannot run are left out.
#[must_use]
pub fn backends() -> Vec<BackendInfo> {
    let created = BACKENDS.iter().filter_map(|entry| (entry.create)("", None).ok());
    created.map(|backend| backend.info().clone()).collect()
}

/// The backend called `name`, after which there may be a colon and what it is to use: `cuda:1` is the second
/// GPU, `cuda:fast` the first one with arithmetic that does not repeat the bits of the CPU. One that computes on the processor uses that many `threads`, or as
/// many as the machine has; others ignore them.
///
/// # Errors
/// [`BackendError::Unknown`] with the names there are; [`BackendError::Unusable`] if this machine
/// cannot run it.
pub fn backend_create(
    name: &str,
    threads: Option<NonZeroUsize>,
) -> Result<Box<dyn Backend>, BackendError> {
    let (known, options) = name.split_once(':').unwrap_or((name, ""));
    match BACKENDS.iter().find(|entry| entry.name == known) {
        Some(entry) => Ok((entry.create)(options, threads)?),
        None => Err(BackendError::Unknown {
            name: name.to_owned(),
            available: BACKENDS.iter().map(|entry| entry.name).collect(),
        }),
    }
}

#[cfg(all(test, feature = "cpu"))]
mod tests {
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
        assert_eq!(error.to_string(), "unknown backend `abacus`; this build has: cpu");
    }
}
