//! Which of its forms the kernel of the linear solvers takes for a system, and its launch.

use cloth_core::{Error, Result};

use super::LinearMemory;
use crate::{
    fault::BACKEND, kernel_cache::KernelCache, layout::CudaReal, memory::Memory, queue::Launch,
    schwarz::TEAMS, solver_form::SolverForm,
};

/// Bytes of shared memory of a team, as in `shared/schwarz.cuh`.
const TEAM_MEMORY: usize = 5 * 96 * size_of::<f64>();

/// The form that is fastest for the present system, as that of `cache` from now on, and its launch.
///
/// # Errors
/// `Unsupported` without shared memory enough; `OutOfMemory`, `KernelCompile`; what the device reports.
pub(crate) fn choose<T: CudaReal>(
    (module, name): (&'static str, &'static str),
    memory: &Memory<T>,
    cache: &mut KernelCache,
    linear: &mut LinearMemory<T>,
) -> Result<Launch> {
    let particles = memory.data.count as usize;
    let device = &memory.queue.device;
    let multiprocessors = device.multiprocessors as usize;
    let has_contacts = linear.data.has_contacts != 0;
    let form = SolverForm::of(particles, multiprocessors, linear.is_schwarz(), has_contacts);
    cache.solver = form;
    let key = (name, form);
    if let Some(&launch) = linear.launches.get(&key) {
        return Ok(launch);
    }
    let kernel = cache.kernel(module, name)?;
    let shared = match form {
        SolverForm::General | SolverForm::Teams => 0,
        SolverForm::Schwarz => TEAMS * TEAM_MEMORY,
    };
    if shared > device.shared_left(kernel)? {
        let feature = "the preconditioner schwarz on a GPU with so little shared memory".into();
        return Err(Error::Unsupported { backend: BACKEND, feature });
    }
    let threads = SolverForm::THREADS as u32;
    let resident = device.resident_blocks(kernel, threads, shared)?;
    let mut wanted = particles.div_ceil(form.step()) as u32;
    if let Some(schwarz) = linear.schwarz.as_ref().filter(|_| form == SolverForm::Schwarz) {
        wanted = wanted.max(schwarz.blocks_wanted());
    }
    let launch = Launch { blocks: resident.min(wanted), threads, shared, cooperative: true };
    linear.launches.insert(key, launch);
    Ok(launch)
}
