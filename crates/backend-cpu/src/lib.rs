//! CPU backend: the reference for all others, and a fast one.
//!
//! Each stage of NUMERICS has a module of its name. Particles are kept as structure of arrays and
//! worked on in packets of sixteen by loops that the compiler turns into vector
//! instructions, for the widest instruction set that the processor has (`pulp` chooses at run time).
//! Arithmetic is the same, operation for operation, at every width and on any number of threads, so
//! that results are the same bits.

#![cfg_attr(
    test,
    allow(dead_code, reason = "unit tests are compiled without what puts the parts together")
)]
#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes and axes index several arrays at once, the form that vectorises"
)]

mod aerodynamic_forces;
mod block_impulses;
mod collider_response;
mod collider_sweep;
mod contact;
mod control_forces;
mod distance_grid;
mod elasticity;
// Unit tests are of single parts. Without this module the whole engine is not compiled a second time for them, for each precision
// and instruction set.
#[cfg(not(test))]
mod engine;
mod explicit_substep;
mod fabric;
mod field_forces;
mod implicit;
mod integrate_explicit;
mod integrate_implicit;
mod kernels;
mod measure;
mod memory;
mod phases;
mod procedural_forces;
mod semi_implicit;
mod shared;
mod sparse_cholesky;
mod spring_forces;
mod springs;
mod strain_limit;
mod triangle_contact;
mod triangles;
mod vector;
mod vertex_normals;

/// How it works, with the table of its forms.
pub mod how_it_works {
    #![doc = include_str!("../BACKEND.md")]
}

use std::{num::NonZeroUsize, sync::Arc};

use cloth_core::{BackendInfo, Error, Precision, Result, SolverConfig, Team};
use rayon::ThreadPoolBuilder;

/// The CPU, through a pool of threads.
#[derive(Clone)]
pub struct CpuBackend {
    info: BackendInfo,
    team: Arc<Team>,
    arch: pulp::Arch,
}

impl CpuBackend {
    /// A backend with its own pool of `threads`, or as many as the machine has.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for more than 1024 threads, [`Error::NoDevice`] if they cannot be
    /// started.
    pub fn new(threads: Option<NonZeroUsize>) -> Result<Self> {
        let (team, arch) = (team(threads)?, pulp::Arch::new());
        let info = BackendInfo {
            name: "cpu",
            device: format!("{} threads", team.threads()),
            precisions: vec![Precision::F32, Precision::F64],
            details: vec![("instructions", instructions(arch).to_owned())],
        };
        Ok(Self { info, team: Arc::new(team), arch })
    }

    /// The same without wider vector units than those of the target that the program was built for: slower, with the same bits.
    #[must_use]
    pub fn with_narrow_vectors(mut self) -> Self {
        self.arch = pulp::Arch::Scalar;
        self.info.details = vec![("instructions", instructions(self.arch).to_owned())];
        self
    }

    /// The threads for a solver: those of the backend unless the settings ask for another number.
    fn team_for(&self, config: &SolverConfig) -> Result<Arc<Team>> {
        match config.threads {
            Some(threads) if threads.get() != self.team.threads() => {
                Ok(Arc::new(team(Some(threads))?))
            }
            _ => Ok(Arc::clone(&self.team)),
        }
    }
}

/// The instruction set that the kernels run with.
fn instructions(arch: pulp::Arch) -> &'static str {
    match arch {
        #[cfg(target_arch = "x86_64")]
        pulp::Arch::V4(_) => "AVX-512",
        #[cfg(target_arch = "x86_64")]
        pulp::Arch::V3(_) => "AVX2 and FMA units, without contraction",
        _ => "those of the target the program was built for",
    }
}

/// Threads that a pool may have: far more than any machine, far fewer than it takes to exhaust one.
const THREADS_MAX: usize = 1024;

fn team(threads: Option<NonZeroUsize>) -> Result<Team> {
    if let Some(threads) = threads.filter(|threads| threads.get() > THREADS_MAX) {
        return Err(Error::LimitExceeded {
            limit: "threads of the cpu backend",
            requested: threads.get() as u64,
            max: THREADS_MAX as u64,
        });
    }
    ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, NonZeroUsize::get))
        .thread_name(|index| format!("cloth-cpu-{index}"))
        .build()
        .map(Team::new)
        .map_err(|error| Error::NoDevice { backend: "cpu", reason: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absurd_number_of_threads_is_refused() {
        let error = CpuBackend::new(NonZeroUsize::new(100_000)).map(|_| ()).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { requested: 100_000, max: 1024, .. }));
    }
}
