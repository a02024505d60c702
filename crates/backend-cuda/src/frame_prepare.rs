//! Which form the kernel of explicit frames takes for a model, and its launch.

use cloth_core::{
    BlockDependencies, ColourRegions, Integrator, Model, ModelFeatures, Result, SolverConfig,
};

use crate::{
    forms::{FrameForm, FrameSizes, limit_shared_bytes},
    layout::CudaReal,
    memory::Memory,
    patch::{CONTACT_GROUPS, Patch, STENCIL_FORCES, contact_shared_bytes},
    queue::{Buffer, Launch, THREADS},
    tables::{SpringTables, StrainTables},
};

/// Particles of a tile and around it, as in `explicit_substep.cu`.
const TILE_ENTRIES: usize = 37 * 12;
/// Threads of a block of `explicit_substep_tiles.cu` and `explicit_substep_flat.cu`, and forces that it keeps, as in
/// `patch/pairs.cuh`.
const PAIR_THREADS: u32 = 128;
const PAIR_FORCES: usize = 5 * 11 * 35;
/// Threads of a block of `explicit_substep_contact.cu`, of `explicit_substep_mesh.cu`, and of `explicit_substep_stages.cu`.
const CONTACT_THREADS: u32 = 512;
const MESH_THREADS: u32 = 640;
const STAGES_THREADS: u32 = 512;
/// Blocks of the forms for many tiles, `LIST_RUNS` of `patch/tile_list.cuh`.
const RUNS_MAX: usize = 1024;
/// Bytes of shared memory that the table of springs may take in the frame kernel.
const TABLE_MAX: usize = 20 << 10;
/// Particles of a region of the strain limit, at most.
const REGION_MAX: usize = 512;
/// Bytes of shared memory that a block has beside those that depend on the model, at most.
const STAGES_STATIC: usize = 24 << 10;

/// What the fields of a counter of meetings hold, two counters in turn (`shared/meeting.cuh`).
const MEETINGS_MAX: usize = (1 << 24) - 1;

/// Meetings of all blocks in a substep of `explicit_substep_stages.cu`, at most.
fn meetings<T>(has_regions: bool, strain: &StrainTables<T>) -> usize {
    // Those of triangles, the pass, the search for partners and impulses, and of a list that is built.
    const OTHERS: usize = 9;
    let sweeps = strain.sweeps as usize;
    OTHERS + if has_regions { sweeps } else { sweeps * (strain.colours.len() - 1) + 1 }
}

/// Bytes of the springs of shared rows.
fn table_bytes<T: CudaReal>(springs: &SpringTables<T>) -> usize {
    let entry = if T::DOUBLE { 32 } else { 16 };
    springs.entries.len() * entry + springs.headers.len().next_multiple_of(2) * 8
}

/// Whether these springs fit into shared memory.
fn is_in_shared<T: CudaReal>(springs: &SpringTables<T>) -> bool {
    springs.is_regular && table_bytes(springs) <= TABLE_MAX
}

/// What forms depend on beside features.
pub(crate) fn sizes<T: CudaReal>(
    model: &Model,
    springs: &SpringTables<T>,
    (multiprocessors, shared_max): (usize, usize),
) -> FrameSizes {
    let in_shared = is_in_shared(springs);
    FrameSizes {
        particles: model.particle_count(),
        patch: if in_shared { Patch::of(model) } else { None },
        is_packed: !in_shared && !springs.packed.is_empty(),
        multiprocessors,
        shared_max,
    }
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

impl<T: CudaReal> Memory<T> {
    /// Chooses form, variant and size of the frame kernel. Gives the patch whose tiles it works on, if it does.
    pub(crate) fn frame_prepare(
        &mut self,
        model: &Model,
        config: &SolverConfig,
        strain: &StrainTables<T>,
    ) -> Result<Option<Patch>> {
        let device = &self.queue.device;
        let multiprocessors = device.multiprocessors as usize;
        let sizes = sizes(model, &self.springs, (multiprocessors, device.shared_max));
        // Kernels of other integrators look for contact in the groups that the frame kernel has.
        let is_frame = config.integrator == Integrator::Explicit && !model.has_triangle_contact();
        self.frame_form = if is_frame {
            FrameForm::choose(ModelFeatures::new(model, config).set(), &sizes)
        } else {
            FrameForm::Pass
        };
        if self.frame_form == FrameForm::Stages {
            self.stages_prepare(model, strain)?;
            return Ok(None);
        }
        let n = sizes.particles;
        let table = table_bytes(&self.springs);
        let in_shared = is_in_shared(&self.springs);
        let patch = sizes.patch;
        let mut options = self.options_common(model);
        if in_shared {
            options.push("table");
        } else if sizes.is_packed {
            options.push("packed");
        }
        if patch.is_some() {
            options.push("grid");
        }
        // In double precision the forces of a tile do not fit beside it.
        let stencil = patch.filter(|_| !T::DOUBLE).and_then(|patch| patch.stencil(model));
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
            self.data.stencil = kinds.map(|kind| {
                let [rest_length, stiffness, damping, _] = self.springs.kinds[kind as usize];
                [rest_length, stiffness, damping]
            });
        }
        let (items, is_small) = (sizes.items(), sizes.is_small());
        if is_small {
            options.push("many_registers");
        }
        let mut threads = THREADS;
        let groups = items * CONTACT_GROUPS;
        match self.frame_form {
            FrameForm::PatchContact => {
                self.packets = Buffer::zeros(&self.queue, 4 * n + 6 * groups + 2 * items)?;
                threads = CONTACT_THREADS;
                shared = contact_shared_bytes::<T>(groups);
            }
            FrameForm::Patch => self.packets = Buffer::zeros(&self.queue, 4 * n)?,
            FrameForm::PatchFlat | FrameForm::PatchTiles => {
                threads = PAIR_THREADS;
                shared = tile + 3 * PAIR_FORCES * size_of::<T>();
            }
            FrameForm::Mesh => threads = MESH_THREADS,
            FrameForm::Pass | FrameForm::Stages => {}
        }
        self.data.packets = self.packets.address();
        if let Some(patch) = patch {
            self.data.columns = patch.columns as u32;
            self.data.rows = patch.rows as u32;
        }
        if model.has_triangle_contact() {
            // Its substeps are made of single stages: the frame kernel takes long to compile, for nothing.
            return Ok(patch);
        }
        let has_runs = matches!(self.frame_form, FrameForm::PatchFlat | FrameForm::PatchTiles);
        self.options = options;
        let kernel = self.kernel(self.frame_form.module(), "explicit_frame")?;
        let resident = self.queue.device.resident_blocks(kernel, threads, shared)? as usize;
        let blocks = if is_small { resident.min(multiprocessors) } else { resident };
        let mut chunk = items.div_ceil(blocks);
        if patch.is_none() {
            chunk = chunk.next_multiple_of(32);
        }
        let blocks = if has_runs { blocks.min(items).min(RUNS_MAX) } else { items.div_ceil(chunk) };
        self.data.chunk = chunk as u32;
        self.frame = Launch { blocks: blocks as u32, threads, shared, cooperative: true };
        let dependencies =
            BlockDependencies::new(&model.interactions(), blocks, |particle| match patch {
                // Block b has the tiles from b items / blocks on.
                Some(patch) if has_runs => {
                    ((patch.tile_in_strips(particle) + 1) * blocks - 1) / items
                }
                Some(patch) => patch.tile_of(particle) / chunk,
                None => particle / chunk,
            });
        let rows = Buffer::of(&self.queue, &dependencies.rows)?;
        let others = Buffer::of(&self.queue, &dependencies.blocks)?;
        self.progress = Buffer::zeros(&self.queue, blocks)?;
        self.data.dependency_rows = rows.address();
        self.data.dependencies = others.address();
        self.data.progress = self.progress.address();
        self.tables.push(Box::new(rows));
        self.tables.push(Box::new(others));
        Ok(patch)
    }

    /// Options of all general forms.
    fn options_common(&self, model: &Model) -> Vec<&'static str> {
        let mut options = Vec::new();
        let points = model.self_contact().filter(|contact| !contact.is_of_triangles());
        if points.is_some_and(|contact| !contact.excludes_neighbours()) {
            options.push("penalty");
        }
        if model.air().is_some() || self.springs.can_buckle || self.impulses.is_some() {
            options.push("extras");
        }
        options
    }

    /// The form for models in which stages follow the pass.
    fn stages_prepare(&mut self, model: &Model, strain: &StrainTables<T>) -> Result<()> {
        let mut options = self.options_common(model);
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
            options.extend(["fabric", "extras", "many_registers"]);
        } else if !self.springs.packed.is_empty() {
            options.push("packed");
        }
        let multiprocessors = self.queue.device.multiprocessors as usize;
        let n = model.particle_count();
        let is_small = n <= multiprocessors * STAGES_THREADS as usize;
        if is_small && !model.has_fabric() {
            options.push("many_registers");
        }
        self.options = options;
        let size = region_size(model, multiprocessors);
        let most =
            (self.queue.device.shared_max - STAGES_STATIC) / limit_shared_bytes::<T>(1, 1).max(1);
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
            && shared + near + STAGES_STATIC <= self.queue.device.shared_max;
        if keeps {
            shared += near;
        }
        self.data.limit_owned_max = owned as u32;
        self.data.limit_springs_near = if keeps { springs as u32 } else { 0 };
        self.regions_upload(&regions, strain)?;
        let module = FrameForm::Stages.module();
        let kernel = self.kernel(module, "explicit_frame")?;
        let resident = self.queue.device.resident_blocks(kernel, STAGES_THREADS, shared)? as usize;
        let most = if is_small { multiprocessors } else { n.div_ceil(STAGES_THREADS as usize) };
        let blocks = resident.min(most).max(1);
        self.data.chunk = n.div_ceil(blocks).next_multiple_of(32) as u32;
        let meetings = meetings(self.data.limit_region_count > 0, strain);
        self.substeps_max = (2 * MEETINGS_MAX / (blocks * meetings)).clamp(1, self.substeps_max);
        self.motions = FrameForm::Stages.motions(
            self.options.contains(&"impulses"),
            strain.sweeps,
            self.data.limit_region_count > 0,
        );
        self.frame =
            Launch { blocks: blocks as u32, threads: STAGES_THREADS, shared, cooperative: true };
        Ok(())
    }

    /// The regions of the strain limit, or, without any, the colours.
    fn regions_upload(&mut self, regions: &ColourRegions, strain: &StrainTables<T>) -> Result<()> {
        let colours = strain.colours.len() as u32 - 1;
        let headers: Vec<[u32; 4]> = regions
            .regions
            .iter()
            .map(|region| [region.first_particle, region.owned, region.particles, 0])
            .collect();
        let springs: Vec<[u32; 2]> =
            regions.springs.iter().map(|&[i, j, kind]| [i | (j << 16), kind]).collect();
        let rows = if headers.is_empty() { &strain.colours } else { &regions.rows };
        let buffers = (
            Buffer::of(&self.queue, &headers)?,
            Buffer::of(&self.queue, &regions.particles)?,
            Buffer::of(&self.queue, rows)?,
            Buffer::of(&self.queue, &springs)?,
        );
        self.data.limit_regions = buffers.0.address();
        self.data.limit_particles = buffers.1.address();
        self.data.limit_rows = buffers.2.address();
        self.data.limit_springs = buffers.3.address();
        self.data.limit_region_count = headers.len() as u32;
        self.data.limit_colours = colours;
        self.data.limit_sweeps = strain.sweeps;
        self.data.limit_particles_max = regions.particles_max() as u32;
        self.tables.push(Box::new(buffers));
        Ok(())
    }
}
