//! Whether a scene fits into this machine, asked before any of its memory is taken.

use cloth::scene::{CompileOptions, MemoryEstimate, Scene};
use sysinfo::System;

use crate::{failure::Failure, units::bytes_text};

#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "scene `{name}` with {} particles needs about {} of memory, but {} are available: {} are \
     missing; use fewer particles or a machine with more memory",
    estimate.particles, bytes_text(estimate.bytes), bytes_text(*available),
    bytes_text(estimate.bytes.saturating_sub(*available))
)]
struct MemoryError {
    name: String,
    estimate: MemoryEstimate,
    available: u64,
}

/// What the program itself takes \[byte\]: its code as far as it runs, stacks, buffers of files.
const PROGRAM_BYTES: u64 = 12 << 20;

/// Memory that a run of a scene takes at its peak.
pub(crate) fn needed(scene: &Scene, options: &CompileOptions) -> MemoryEstimate {
    let estimate = scene.memory_estimate(options);
    MemoryEstimate { bytes: estimate.bytes.saturating_add(PROGRAM_BYTES), ..estimate }
}

/// Memory that this process can take \[byte\], within the limit of a container if there is one; all
/// the memory in the world where the system does not tell.
fn available() -> u64 {
    let Ok(mut system) = System::new() else { return u64::MAX };
    system.refresh_memory();
    // Not the memory that is free in the container: that would count cached files as taken.
    let container =
        system.cgroup_limits().map(|limits| limits.total_memory.saturating_sub(limits.rss));
    system.available_memory().min(container.unwrap_or(u64::MAX)).min(address_space())
}

/// Bytes of address space that a thread takes for its stack, with room for what the C library keeps for it.
#[cfg(unix)]
const THREAD_BYTES: u64 = 4 << 20;

/// Address space that is left of a limit such as that of `ulimit -v`, for data, with stacks taken off.
#[cfg(unix)]
fn address_space() -> u64 {
    use nix::sys::resource::{RLIM_INFINITY, Resource, getrlimit};

    let limit = match getrlimit(Resource::RLIMIT_AS) {
        Ok((limit, _)) if limit != RLIM_INFINITY => limit,
        _ => return u64::MAX,
    };
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let size = status.lines().find_map(|line| line.strip_prefix("VmSize:"));
    let kilobytes = size.and_then(|size| size.split_whitespace().next()?.parse().ok());
    let used = kilobytes.unwrap_or(0_u64).saturating_mul(1024);
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    limit.saturating_sub(used).saturating_sub(THREAD_BYTES * (threads as u64 + 2))
}

#[cfg(not(unix))]
const fn address_space() -> u64 {
    u64::MAX
}

/// Refuses a scene that needs more memory than there is.
pub(crate) fn check(scene: &Scene, options: &CompileOptions) -> Result<(), Failure> {
    check_with(scene, options, available())
}

fn check_with(scene: &Scene, options: &CompileOptions, available: u64) -> Result<(), Failure> {
    let estimate = needed(scene, options);
    if estimate.bytes <= available {
        return Ok(());
    }
    Err(Failure::input(MemoryError { name: scene.name.clone(), estimate, available }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_machine_has_memory() {
        assert!(available() > 1 << 20);
    }

    #[test]
    fn the_limit_is_the_estimate() {
        let scene = Scene::builtin("drape").unwrap();
        let options = CompileOptions::default();
        let estimate = needed(&scene, &options);
        assert!(check_with(&scene, &options, estimate.bytes).is_ok());
        let error = check_with(&scene, &options, estimate.bytes - 1024).unwrap_err();
        assert!(error.to_string().contains("1.00 KiB are missing"), "{error}");
    }
}
