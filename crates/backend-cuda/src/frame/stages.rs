//! The form for models in which stages follow the pass.

use cloth_core::{ColourRegions, Model, Result};

use super::{FrameLaunch, FrameModel, SUBSTEPS_MAX};
use crate::{
    forms::{FrameForm, limit_shared_bytes},
    kernel_cache::KernelCache,
    layout::{CudaReal, SolverData},
    queue::{Buffer, Launch, Queue},
    tables::StrainTables,
};

/// Threads of a block of `explicit_substep_stages.cu`.
const STAGES_THREADS: u32 = 512;
/// Particles of a region of the strain limit, at most.
const REGION_MAX: usize = 512;
/// Bytes of shared memory that a block has beside those that depend on the model, at most.
const STAGES_STATIC: usize = 24 << 10;
/// What the fields of a counter of meetings hold, two counters in turn (`shared/meeting.cuh`).
const MEETINGS_MAX: usize = (1 << 24) - 1;

/// Where regions, their particles, rows and springs lie.
type RegionTables = (Buffer<[u32; 4]>, Buffer<u32>, Buffer<u32>, Buffer<[u32; 2]>);

/// Meetings of all blocks in a substep of `explicit_substep_stages.cu`, at most.
fn meetings<T>(has_regions: bool, strain: &StrainTables<T>) -> usize {
    // Those of triangles, the pass, the search for partners and impulses, and of a list that is built.
    const OTHERS: usize = 9;
    let sweeps = strain.sweeps as usize;
    let colours = strain.colours.len() + strain.triangle_colours.len() - 2;
    OTHERS + if has_regions { sweeps } else { sweeps * colours + 1 }
}

/// Particles of a region of the strain limit: a region for each multiprocessor, if these are not too large.
fn region_size(model: &Model, multiprocessors: usize) -> usize {
    let regions = |size: usize| {
        model.cloths().iter().map(|cloth| cloth.particles.len().div_ceil(size)).sum::<usize>()
    };
    let mut size = model.particle_count().div_ceil(multiprocessors).next_multiple_of(32);
    while size < REGION_MAX && regions(size) > multiprocessors {
        size += 32;
    }
    size.min(REGION_MAX)
}

/// Variant and size of this form.
pub(super) fn launch<T: CudaReal>(
    of: &FrameModel<'_, T>,
    queue: &Queue,
    cache: &mut KernelCache,
    data: &mut SolverData<T>,
) -> Result<FrameLaunch> {
    let FrameModel { model, strain, .. } = of;
    let mut options = of.options_common();
    let points = model.self_contact().filter(|contact| !contact.is_of_triangles());
    if points.is_some_and(|contact| contact.excludes_neighbours()) {
        options.push("impulses");
    }
    if strain.sweeps > 0 {
        options.push("limits");
    }
    if model.has_fabric() {
        // Built in one form for all sizes and kinds of springs.
        options.retain(|&option| option != "extras");
        options.extend(["fabric", "extras"]);
    } else if !of.springs.packed.is_empty() {
        options.push("packed");
    }
    let multiprocessors = queue.device.multiprocessors as usize;
    let n = model.particle_count();
    let is_small = n <= multiprocessors * STAGES_THREADS as usize;
    if is_small && !model.has_fabric() {
        options.push("many_registers");
    }
    let has_impulses = options.contains(&"impulses");
    cache.frame_options = options;
    let size = region_size(model, multiprocessors);
    let most = (queue.device.shared_max - STAGES_STATIC) / limit_shared_bytes::<T>(1, 1).max(1);
    let regions = if strain.sweeps > 0 {
        strain.regions(model, size, most.min(usize::from(u16::MAX)))
    } else {
        ColourRegions::default()
    };
    let owned = regions.regions.iter().map(|region| region.owned).max().unwrap_or(0) as usize;
    let mut shared = limit_shared_bytes::<T>(regions.particles_max(), owned);
    // Each block keeps the springs of its region, if it has one alone and room for them.
    let colours = strain.colours.len() - 1;
    let springs = regions.springs_max(colours);
    let near = springs * size_of::<[u32; 2]>() + (colours + 1) * size_of::<u32>();
    let keeps = is_small
        && regions.regions.len() <= multiprocessors
        && shared + near + STAGES_STATIC <= queue.device.shared_max;
    if keeps {
        shared += near;
    }
    data.limit_owned_max = owned as u32;
    data.limit_springs_near = if keeps { springs as u32 } else { 0 };
    let tables = regions_upload(&regions, queue, data)?;
    let kernel = cache.kernel(FrameForm::Stages.module(), "explicit_frame")?;
    let resident = queue.device.resident_blocks(kernel, STAGES_THREADS, shared)? as usize;
    let most = if is_small { multiprocessors } else { n.div_ceil(STAGES_THREADS as usize) };
    let blocks = resident.min(most).max(1);
    data.chunk = n.div_ceil(blocks).next_multiple_of(32) as u32;
    let has_regions = data.limit_region_count > 0;
    let meetings = meetings(has_regions, strain);
    Ok(FrameLaunch {
        form: FrameForm::Stages,
        launch: Launch {
            blocks: blocks as u32,
            threads: STAGES_THREADS,
            shared,
            cooperative: true,
        },
        substeps_max: (2 * MEETINGS_MAX / (blocks * meetings)).clamp(1, SUBSTEPS_MAX),
        motions: FrameForm::Stages.motions(has_impulses, strain.sweeps, has_regions),
        held: vec![Box::new(tables)],
    })
}

/// The regions of the strain limit.
fn regions_upload<T: CudaReal>(
    regions: &ColourRegions,
    queue: &Queue,
    data: &mut SolverData<T>,
) -> Result<RegionTables> {
    let headers: Vec<[u32; 4]> = regions
        .regions
        .iter()
        .map(|region| [region.first_particle, region.owned, region.particles, 0])
        .collect();
    let springs: Vec<[u32; 2]> =
        regions.springs.iter().map(|&[i, j, kind]| [i | (j << 16), kind]).collect();
    let buffers = (
        Buffer::of(queue, &headers)?,
        Buffer::of(queue, &regions.particles)?,
        Buffer::of(queue, &regions.rows)?,
        Buffer::of(queue, &springs)?,
    );
    data.limit_regions = buffers.0.address();
    data.limit_particles = buffers.1.address();
    data.limit_rows = buffers.2.address();
    data.limit_springs = buffers.3.address();
    data.limit_region_count = headers.len() as u32;
    data.limit_particles_max = regions.particles_max() as u32;
    Ok(buffers)
}
