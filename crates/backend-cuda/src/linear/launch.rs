//! Which of its forms the kernel of the linear solvers takes for a system, and its launch.

use cloth_core::{Error, Result};

use super::LinearMemory;
use crate::{
    fault::BACKEND,
    kernel_cache::KernelCache,
    layout::{BLOCK, CudaReal, Real4},
    memory::Memory,
    queue::Launch,
    schwarz::TEAMS,
    solver_form::{SolveNeeds, SolverForm},
};

/// Springs of a particle, blocks of sums, and places of a window that the resident form has room for, as in
/// `shared/resident.cuh`.
const RESIDENT_SPRINGS: u32 = 24;
const RESIDENT_BLOCKS: usize = 96;
const RESIDENT_PLACES: usize = 1 << 16;
/// Entries of shared memory for a tile, as in `conjugate_gradient_patch.cu`: origins and vectors of 32 by 16 particles and two
/// around them on all sides.
const PATCH_ENTRIES: usize = 2 * 36 * 20;
/// Bytes of shared memory of a team, as in `shared/schwarz.cuh`.
const TEAM_MEMORY: usize = 4 * 5376 + 2 * 8 * 96;
/// Particles up to which rows are worked out by several threads each.
const TEAMS_PARTICLES_MAX: usize = 1 << 17;

/// The launch of kernel `name` in a form, if the model, the precision and the device are such that the present system
/// can be solved in it.
fn launch<T: CudaReal>(
    form: SolverForm,
    name: &'static str,
    memory: &Memory<T>,
    cache: &mut KernelCache,
    linear: &LinearMemory<T>,
    needs: SolveNeeds,
) -> Result<Option<Launch>> {
    if needs.schwarz != (form == SolverForm::Schwarz)
        || needs.energy && matches!(form, SolverForm::Patch | SolverForm::Resident)
    {
        return Ok(None);
    }
    let n = memory.data.count as usize;
    let is_resident = form == SolverForm::Resident;
    // Particles of a block, and all that their neighbours can be.
    let places = form.threads() + 2 * linear.data.reach as usize;
    let is_possible = !T::DOUBLE
        && !linear.has_contact()
        && linear.elements.is_none()
        && memory.tables.springs.longest_row() <= RESIDENT_SPRINGS
        && n.div_ceil(BLOCK) <= RESIDENT_BLOCKS
        && places <= RESIDENT_PLACES;
    if is_resident && !is_possible {
        return Ok(None);
    }
    if form == SolverForm::Patch
        && (T::DOUBLE
            || linear.elements.is_some()
            || linear.data.has_contacts != 0
            || !linear.is_patch()
            || n < TEAMS_PARTICLES_MAX)
    {
        return Ok(None);
    }
    cache.solver = form;
    let kernel = cache.kernel(form.module(), name)?;
    let device = &memory.queue.device;
    let shared = match form {
        SolverForm::General | SolverForm::Teams => 0,
        SolverForm::Schwarz => TEAMS * (TEAM_MEMORY + 96 * size_of::<T>()),
        SolverForm::Patch => PATCH_ENTRIES * size_of::<Real4<T>>(),
        SolverForm::Resident => places * size_of::<Real4<T>>(),
    };
    if shared > device.shared_left(kernel)? {
        return Ok(None);
    }
    let threads = form.threads() as u32;
    let resident = device.resident_blocks(kernel, threads, shared)?;
    let mut wanted = n.div_ceil(form.step()) as u32;
    if form == SolverForm::Schwarz {
        wanted = wanted.max(linear.schwarz.as_ref().map_or(1, |all| all.blocks_wanted()));
    }
    if is_resident && resident < wanted {
        return Ok(None);
    }
    Ok(Some(Launch { blocks: resident.min(wanted), threads, shared, cooperative: true }))
}

/// The form that is fastest for the present system, as that of `cache` from now on, and its launch.
///
/// # Errors
/// `Unsupported` without shared memory enough; `OutOfMemory`, `KernelCompile`; what the device reports.
pub(crate) fn choose<T: CudaReal>(
    name: &'static str,
    memory: &Memory<T>,
    cache: &mut KernelCache,
    linear: &mut LinearMemory<T>,
    energy: bool,
) -> Result<Launch> {
    let needs = SolveNeeds { contact: linear.has_contact(), schwarz: linear.is_schwarz(), energy };
    let key = (name, needs);
    if let Some(&(form, launch)) = linear.launches.get(&key) {
        cache.solver = form;
        return Ok(launch);
    }
    let general = if (memory.data.count as usize) < TEAMS_PARTICLES_MAX {
        SolverForm::Teams
    } else {
        SolverForm::General
    };
    for form in [SolverForm::Resident, SolverForm::Patch, SolverForm::Schwarz, general] {
        if let Some(launch) = launch(form, name, memory, cache, linear, needs)? {
            if form == SolverForm::Resident {
                linear.exchange_prepare(memory)?;
            }
            linear.launches.insert(key, (form, launch));
            return Ok(launch);
        }
    }
    let feature = "the preconditioner schwarz on a GPU with so little shared memory".into();
    Err(Error::Unsupported { backend: BACKEND, feature })
}
