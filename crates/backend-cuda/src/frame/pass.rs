//! The forms whose substep is one pass: that of a large patch that touches itself, and the general one.

use cloth_core::{BlockDependencies, Result};

use super::{FrameLaunch, FrameModel, SUBSTEPS_MAX};
use crate::{
    forms::{FrameForm, FrameSizes},
    kernel_cache::KernelCache,
    layout::{CudaReal, SolverData},
    patch::STENCIL_FORCES,
    queue::{Buffer, Launch, Queue, THREADS},
    tables::SpringTables,
};

/// Particles of a tile and around it, as in `explicit_substep.cu`.
const TILE_ENTRIES: usize = 37 * 12;
/// Threads of a block of `explicit_substep_flat.cu`, and forces that it keeps, as in `patch/pairs.cuh`.
const PAIR_THREADS: u32 = 128;
const PAIR_FORCES: usize = 5 * 11 * 35;
/// Blocks of the form for many tiles, `LIST_RUNS` of `patch/tile_list.cuh`.
const RUNS_MAX: usize = 1024;
/// Bytes of shared memory that the table of springs may take in the frame kernel.
const TABLE_MAX: usize = 20 << 10;

/// Bytes of the springs of shared rows.
fn table_bytes<T: CudaReal>(springs: &SpringTables<T>) -> usize {
    let entry = if T::DOUBLE { 32 } else { 16 };
    springs.entries.len() * entry + springs.headers.len().next_multiple_of(2) * 8
}

/// Whether these springs fit into shared memory.
pub(super) fn is_in_shared<T: CudaReal>(springs: &SpringTables<T>) -> bool {
    springs.is_regular && table_bytes(springs) <= TABLE_MAX
}

/// Variant and size of such a form.
pub(super) fn launch<T: CudaReal>(
    form: FrameForm,
    sizes: &FrameSizes,
    of: &FrameModel<'_, T>,
    queue: &Queue,
    cache: &mut KernelCache,
    data: &mut SolverData<T>,
) -> Result<FrameLaunch> {
    let multiprocessors = sizes.multiprocessors;
    let table = table_bytes(of.springs);
    let in_shared = is_in_shared(of.springs);
    let patch = sizes.patch;
    let mut options = of.options_common();
    if in_shared {
        options.push("table");
    } else if sizes.is_packed {
        options.push("packed");
    }
    if patch.is_some() {
        options.push("grid");
    }
    // In double precision the forces of a tile do not fit beside it.
    let stencil = patch.filter(|_| !T::DOUBLE).and_then(|patch| patch.stencil(of.model));
    let tile = TILE_ENTRIES * 8 * size_of::<T>();
    // As in `explicit_substep.cu`.
    let tiles = if T::DOUBLE || options.contains(&"penalty") { 1 } else { 2 };
    let mut shared = match patch {
        Some(_) if stencil.is_some() => tiles * tile + STENCIL_FORCES * size_of::<T>(),
        Some(_) => tiles * tile + table,
        None if in_shared => table,
        None => 0,
    };
    if let Some(kinds) = stencil {
        options.push("stencil");
        data.stencil = kinds.map(|kind| {
            let [rest_length, stiffness, damping, _] = of.springs.kinds[kind as usize];
            [rest_length, stiffness, damping]
        });
    }
    let (items, is_small) = (sizes.items(), sizes.is_small());
    if is_small {
        options.push("many_registers");
    }
    let mut threads = THREADS;
    let has_runs = form == FrameForm::PatchFlat;
    if has_runs {
        threads = PAIR_THREADS;
        shared = tile + 3 * PAIR_FORCES * size_of::<T>();
    }
    if let Some(patch) = patch {
        data.columns = patch.columns as u32;
        data.rows = patch.rows as u32;
    }
    let mut frame = FrameLaunch {
        form,
        launch: Launch::over(1),
        substeps_max: SUBSTEPS_MAX,
        motions: 1,
        held: Vec::new(),
    };
    if of.model.has_triangle_contact() {
        // Its substeps are made of single stages: the frame kernel takes long to compile, for nothing.
        return Ok(frame);
    }
    cache.frame_options = options;
    let kernel = cache.kernel(form.module(), "explicit_frame")?;
    let resident = queue.device.resident_blocks(kernel, threads, shared)? as usize;
    let blocks = if is_small { resident.min(multiprocessors) } else { resident };
    let mut chunk = items.div_ceil(blocks);
    if patch.is_none() {
        chunk = chunk.next_multiple_of(32);
    }
    let blocks = if has_runs { blocks.min(items).min(RUNS_MAX) } else { items.div_ceil(chunk) };
    data.chunk = chunk as u32;
    frame.launch = Launch { blocks: blocks as u32, threads, shared, cooperative: true };
    let dependencies =
        BlockDependencies::new(&of.model.interactions(), blocks, |particle| match patch {
            // Block b has the tiles from b items / blocks on.
            Some(patch) if has_runs => ((patch.tile_in_strips(particle) + 1) * blocks - 1) / items,
            Some(patch) => patch.tile_of(particle) / chunk,
            None => particle / chunk,
        });
    let rows = Buffer::of(queue, &dependencies.rows)?;
    let others = Buffer::of(queue, &dependencies.blocks)?;
    let progress = Buffer::<u64>::zeros(queue, blocks)?;
    data.dependency_rows = rows.address();
    data.dependencies = others.address();
    data.progress = progress.address();
    frame.held.push(Box::new((rows, others, progress)));
    Ok(frame)
}
