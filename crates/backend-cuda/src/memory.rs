//! All memory of one solver on the device, and the kernels that work on it.

use std::{collections::HashMap, sync::Arc};

use cloth_core::{BlockDependencies, ColliderShape, DistanceGrid, Model, Result, SolverConfig};
use cloth_kernels::CudaModule;

use crate::{
    compile::Target,
    contact::{ContactMemory, GROUP},
    device::{Device, Kernel},
    kernels::ImpulseMemory,
    layout::{
        ColliderData, ControlForceData, CudaReal, GridData, PinData, Real4, SolverData, Status,
        SubstepData,
    },
    procedural,
    queue::{Buffer, Launch, Queue, THREADS},
    solver_form::SolverForm,
    tables::{Patch, SpringTables, StrainTables, TriangleTables},
};

/// Particles of a block of sums, as on the CPU.
pub(crate) const BLOCK: usize = 512;
/// Figures of a block, as `measure.cu` writes them.
pub(crate) const FIGURES: usize = 16;
/// Particles of a tile and around it, as in `explicit_substep.cu`.
const TILE_ENTRIES: usize = 37 * 12;
/// Numbers of the springs of a tile, as in `stencil.cuh`.
const STENCIL_FORCES: usize = 53 * 37 * 3;
/// Threads of a block of `explicit_substep_tiles.cu` and `explicit_substep_flat.cu`, and forces that it keeps, as in
/// `shared/pairs.cuh`.
const PAIR_THREADS: u32 = 128;
const PAIR_FORCES: usize = 5 * 11 * 35;
/// Threads of a block of `explicit_substep_contact.cu`, groups of its tile, particles that it has in shared memory, those that are
/// compared, pairs, and partners that it has room for, as in `shared/area.cuh` and `shared/area_view.cuh`.
const CONTACT_THREADS: u32 = 512;
const CONTACT_GROUPS: usize = 8;
const CONTACT_ENTRIES: usize = 48 * 16 + CONTACT_GROUPS * 64;
const CONTACT_MEMBERS: usize = CONTACT_GROUPS * 16 * GROUP;
const CONTACT_PAIRS: usize = CONTACT_MEMBERS / 2;
const CONTACT_PARTNERS: usize = (15 + 16) * 256;
/// Particles that it can name, and bytes of shared memory that it has beside those that depend on the model, at most.
const CONTACT_PARTICLES_MAX: usize = 1 << 16;
const CONTACT_STATIC: usize = 8704;
const _: () = assert!(
    contact_shared_bytes::<f32>(800) + CONTACT_STATIC <= 163 << 10,
    "a block of compute capability 8.0 has no room for the common workload of 160 x 160 any more",
);
/// Tiles for each multiprocessor from which on these modules are faster.
const TILES_MIN: usize = 4;
/// Tiles of a patch with contact whose list of groups blocks build by comparing their runs, at most: with longer runs they have more in
/// common than that saves. And blocks, `LIST_RUNS` of `shared/tile_list.cuh`.
const TILES_MAX: usize = 1 << 16;
const RUNS_MAX: usize = 1024;
/// Threads of a block of `explicit_substep_mesh.cu`.
const MESH_THREADS: u32 = 640;
/// Bytes of shared memory that the table of springs may take in the frame kernel.
const TABLE_MAX: usize = 20 << 10;

/// A distance grid and its samples on the device.
fn grid_upload<T: CudaReal>(
    queue: &Queue,
    grid: &DistanceGrid,
) -> Result<(Buffer<GridData<T>>, Buffer<f32>)> {
    let distances = Buffer::of(queue, &grid.distances)?;
    let data = GridData {
        distances: distances.address(),
        size: grid.size,
        sets: grid.set_count() as u32,
        origin: grid.origin.map(T::from_f64),
        spacing: T::from_f64(grid.spacing),
        inverse_spacing: T::from_f64(grid.spacing.recip()),
        last: grid.size.map(|side| T::from_f64(f64::from(side - 1))),
        rate: T::from_f64(grid.rate),
        padding: T::ZERO,
    };
    Ok((Buffer::of(queue, &[data])?, distances))
}

/// Device memory of a solver.
pub(crate) struct Memory<T> {
    pub(crate) queue: Queue,
    pub(crate) data: SolverData<T>,
    pub(crate) position: [Buffer<Real4<T>>; 2],
    pub(crate) velocity: [Buffer<Real4<T>>; 2],
    pub(crate) force: Buffer<Real4<T>>,
    pub(crate) kept: Option<[Buffer<Real4<T>>; 2]>,
    /// Positions of the last `start_keep`.
    pub(crate) start: Option<Buffer<Real4<T>>>,
    pub(crate) colliders: Buffer<ColliderData<T>>,
    pub(crate) substeps: Buffer<SubstepData<T>>,
    pub(crate) pins: Buffer<PinData<T>>,
    pub(crate) control_forces: Buffer<ControlForceData<T>>,
    pub(crate) status: Buffer<Status>,
    pub(crate) partials: Buffer<f64>,
    pub(crate) contact: Option<ContactMemory<T>>,
    pub(crate) triangles: Option<[Buffer<u32>; 2]>,
    pub(crate) corners: Option<Buffer<[u32; 4]>>,
    pub(crate) springs: SpringTables<T>,
    pub(crate) colours: Vec<u32>,
    /// For each collider the address of its distance grid, 0 for another shape.
    pub(crate) grids: Vec<u64>,
    pub(crate) impulses: Option<ImpulseMemory>,
    /// The part of kernels that adds the forces of procedural fields, if there are any.
    procedural: Option<String>,
    /// Module and launch of the frame kernel.
    pub(crate) frame_module: &'static str,
    pub(crate) frame: Launch,
    pub(crate) options: Vec<&'static str>,
    /// Held by `data` through their addresses.
    _tables: Vec<Box<dyn std::any::Any + Send>>,
    progress: Buffer<u64>,
    packets: Buffer<[u32; 4]>,
    kernels: HashMap<(&'static str, &'static str, Option<&'static str>), Kernel>,
    /// How the linear system is solved at present.
    pub(crate) solver: SolverForm,
    fast: bool,
}

/// Bytes of shared memory of a block of `explicit_substep_contact.cu` for a patch of so many groups.
const fn contact_shared_bytes<T>(groups: usize) -> usize {
    let particles = 2 * CONTACT_ENTRIES + CONTACT_PAIRS;
    let names = CONTACT_MEMBERS + CONTACT_PARTNERS;
    let lists = CONTACT_GROUPS * groups * size_of::<u16>();
    particles * size_of::<Real4<T>>()
        + names * size_of::<u32>()
        + lists
        + STENCIL_FORCES * size_of::<T>()
}

impl<T: CudaReal> Memory<T> {
    pub(crate) fn new(
        device: Arc<Device>,
        model: &Model,
        config: &SolverConfig,
        (fast, patches): (bool, bool),
    ) -> Result<Self> {
        let queue = Queue::new(device)?;
        let n = model.particle_count();
        let springs = SpringTables::<T>::new(model, patches);
        let strain = StrainTables::<T>::new(model, config.strain_limit.as_ref());
        let mut offsets = vec![T::ZERO; n];
        for cloth in model.cloths() {
            offsets[cloth.particles.start as usize..cloth.particles.end as usize]
                .fill(T::from_f64(0.5 * cloth.thickness));
        }
        let half_density = T::from_f64(model.air().map_or(0.0, |air| 0.5 * air.density));
        let air: Vec<T> = model
            .cloths()
            .iter()
            .flat_map(|cloth| [cloth.aerodynamics.pressure, cloth.aerodynamics.friction])
            .map(|coefficient| half_density * T::from_f64(coefficient))
            .collect();
        let position = [Buffer::zeros(&queue, n)?, Buffer::zeros(&queue, n)?];
        let velocity = [Buffer::zeros(&queue, n)?, Buffer::zeros(&queue, n)?];
        let force = Buffer::zeros(&queue, n)?;
        let status = Buffer::<Status>::zeros(&queue, 1)?;
        let partials = Buffer::zeros(&queue, n.div_ceil(BLOCK) * FIGURES)?;
        let mut data: SolverData<T> = {
            // SAFETY: it is made of integers and floating point numbers alone, for which zero is a value.
            unsafe { std::mem::zeroed() }
        };
        data.position = [position[0].address(), position[1].address(), 0];
        data.velocity = [velocity[0].address(), velocity[1].address(), 0];
        data.force = force.address();
        data.status = status.address();
        data.partials = partials.address();
        data.count = n as u32;
        data.header_count = springs.headers.len() as u32;
        data.entry_count = springs.entries.len() as u32;
        data.kind_count = springs.kinds.len() as u32;
        data.collider_count = model.colliders().len() as u32;
        data.can_buckle = u32::from(springs.can_buckle);
        data.has_air = u32::from(model.air().is_some());
        data.acceleration = model.uniform_acceleration().map(T::from_f64);
        data.drag_rate = model.drag_rate().map(T::from_f64);
        let mut tables: Vec<Box<dyn std::any::Any + Send>> = Vec::new();
        macro_rules! table {
            ($field:ident, $entries:expr) => {{
                let buffer = Buffer::of(&queue, $entries)?;
                data.$field = buffer.address();
                tables.push(Box::new(buffer));
            }};
        }
        table!(spring_row, &springs.rows);
        table!(spring_headers, &springs.headers);
        table!(spring_entries, &springs.entries);
        table!(spring_packed, &springs.packed);
        table!(spring_kinds, &springs.kinds);
        table!(spring_buckling, &springs.buckling);
        table!(offsets, &offsets);
        table!(air, &air);
        table!(limited_springs, &strain.springs);
        table!(longest, &strain.longest);
        let mut grids = vec![0; model.colliders().len()];
        for (collider, address) in model.colliders().iter().zip(&mut grids) {
            if let ColliderShape::Grid(grid) = &collider.shape {
                let (grid, distances) = grid_upload::<T>(&queue, grid)?;
                *address = grid.address();
                tables.push(Box::new(grid));
                tables.push(Box::new(distances));
            }
        }
        let impulses = if model.collider_impulses() && !model.colliders().is_empty() {
            let memory = ImpulseMemory::new(&queue, n, model.colliders().len())?;
            data.impulses = memory.impulses.address();
            Some(memory)
        } else {
            None
        };
        let progress = Buffer::zeros(&queue, 1)?;
        let packets = Buffer::zeros(&queue, 1)?;
        let mut memory = Self {
            colliders: Buffer::zeros(&queue, 1)?,
            substeps: Buffer::zeros(&queue, 1)?,
            pins: Buffer::zeros(&queue, 1)?,
            control_forces: Buffer::zeros(&queue, 1)?,
            kept: None,
            start: None,
            contact: None,
            triangles: None,
            corners: None,
            colours: strain.colours,
            grids,
            impulses,
            procedural: procedural::part::<T>(model),
            frame_module: "explicit_substep",
            frame: Launch::over(1),
            options: Vec::new(),
            _tables: tables,
            kernels: HashMap::new(),
            solver: SolverForm::General,
            fast,
            queue,
            data,
            position,
            velocity,
            force,
            status,
            partials,
            springs,
            progress,
            packets,
        };
        if model.air().is_some() {
            memory.triangles_prepare(model)?;
        }
        let patch = memory.frame_prepare(model)?;
        if let Some(contact) = model.self_contact() {
            let contact_memory = ContactMemory::new(&memory.queue, model, contact, patch)?;
            contact_memory.describe(&mut memory.data, contact.distance, config.time_step);
            memory.contact = Some(contact_memory);
        }
        memory.status_reset()?;
        Ok(memory)
    }

    /// Uploads the triangles, which only air and normals need.
    pub(crate) fn triangles_prepare(&mut self, model: &Model) -> Result<()> {
        if self.triangles.is_some() {
            return Ok(());
        }
        let tables = TriangleTables::new(model);
        let rows = Buffer::of(&self.queue, &tables.rows)?;
        let entries = Buffer::of(&self.queue, &tables.entries)?;
        let corners = Buffer::of(&self.queue, &tables.triangles)?;
        self.data.triangle_rows = rows.address();
        self.data.triangle_entries = entries.address();
        self.data.triangles = corners.address();
        self.triangles = Some([rows, entries]);
        self.corners = Some(corners);
        Ok(())
    }

    /// Chooses the variant and the size of the frame kernel. Gives the patch whose tiles it works on, if it does.
    fn frame_prepare(&mut self, model: &Model) -> Result<Option<Patch>> {
        let n = model.particle_count();
        let entry = if T::DOUBLE { 32 } else { 16 };
        let headers = self.springs.headers.len().next_multiple_of(2) * 8;
        let table = self.springs.entries.len() * entry + headers;
        let in_shared = self.springs.is_regular && table <= TABLE_MAX;
        let patch = if in_shared { Patch::of(model) } else { None };
        let mut options = Vec::new();
        if model.self_contact().is_some_and(|contact| !contact.excludes_neighbours()) {
            options.push("penalty");
        }
        let has_impulses = self.impulses.is_some();
        if model.air().is_some() || self.springs.can_buckle || has_impulses {
            options.push("extras");
        }
        if in_shared {
            options.push("table");
        } else if !self.springs.packed.is_empty() {
            options.push("packed");
        }
        if patch.is_some() {
            options.push("grid");
        }
        let has_penalty = options.contains(&"penalty");
        // In double precision the forces of a tile do not fit beside it.
        let stencil = patch.filter(|_| !T::DOUBLE).and_then(|patch| patch.stencil(model));
        let tile = TILE_ENTRIES * 8 * size_of::<T>();
        // As in `explicit_substep.cu`.
        let tiles = if T::DOUBLE || has_penalty { 1 } else { 2 };
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
        let multiprocessors = self.queue.device.multiprocessors as usize;
        // What is handed out to blocks: tiles of a patch, or particles.
        let (items, unit) = patch.map_or((n, THREADS as usize), |patch| (patch.tiles(), 1));
        let is_small = items <= multiprocessors * unit;
        if is_small {
            options.push("wide");
        }
        let has_extras = options.contains(&"extras");
        let is_plain = !has_penalty && !has_extras;
        let mut threads = THREADS;
        let tiles_max = if has_penalty { TILES_MAX } else { usize::MAX };
        let has_runs = stencil.is_some()
            && !has_extras
            && (TILES_MIN * multiprocessors..=tiles_max).contains(&items);
        let groups = items * CONTACT_GROUPS;
        let contact_shared = contact_shared_bytes::<T>(groups);
        let has_contact_tiles = is_small
            && has_penalty
            && !has_extras
            && stencil.is_some()
            && n < CONTACT_PARTICLES_MAX
            && contact_shared + CONTACT_STATIC <= self.queue.device.shared_max;
        if has_contact_tiles {
            self.frame_module = "explicit_substep_contact";
            self.packets = Buffer::zeros(&self.queue, 4 * n + 6 * groups + 2 * items)?;
            self.data.packets = self.packets.address();
            threads = CONTACT_THREADS;
            shared = contact_shared;
        } else if is_small && is_plain && stencil.is_some() {
            self.frame_module = "explicit_substep_patch";
            self.packets = Buffer::zeros(&self.queue, 4 * n)?;
            self.data.packets = self.packets.address();
        } else if has_runs {
            self.frame_module =
                if has_penalty { "explicit_substep_flat" } else { "explicit_substep_tiles" };
            threads = PAIR_THREADS;
            shared = tile + 3 * PAIR_FORCES * size_of::<T>();
        } else if !is_small && is_plain && !T::DOUBLE && options.contains(&"packed") {
            self.frame_module = "explicit_substep_mesh";
            threads = MESH_THREADS;
        }
        self.options = options;
        let kernel = self.kernel(self.frame_module, "explicit_frame")?;
        let resident = self.queue.device.resident_blocks(kernel, threads, shared)? as usize;
        let blocks = if is_small { resident.min(multiprocessors) } else { resident };
        let mut chunk = items.div_ceil(blocks);
        if let Some(patch) = patch {
            self.data.columns = patch.columns as u32;
            self.data.rows = patch.rows as u32;
        } else {
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
        self._tables.push(Box::new(rows));
        self._tables.push(Box::new(others));
        Ok(patch)
    }

    /// The launch of the kernel that finds contacts alone: as many warps as there are groups, if they fit.
    pub(crate) fn contacts_launch(&mut self) -> Result<Launch> {
        let kernel = self.kernel("contact_candidates", "contact_candidates")?;
        let resident = self.queue.device.resident_blocks(kernel, THREADS, 0)?;
        let blocks = resident.min(self.data.group_count.div_ceil(THREADS / 32));
        Ok(Launch { blocks, threads: THREADS, shared: 0, cooperative: true })
    }

    /// A kernel of a module, compiled if need be.
    pub(crate) fn kernel(&mut self, module: &'static str, name: &'static str) -> Result<Kernel> {
        let solver = self.solver.option().filter(|_| module == self.solver.module());
        if let Some(kernel) = self.kernels.get(&(module, name, solver)) {
            return Ok(*kernel);
        }
        let Some(source) = CudaModule::find(module) else {
            let log = "there is no module of this name".to_owned();
            return Err(cloth_core::Error::KernelCompile { kernel: module, log });
        };
        let options: &[_] = match module {
            "explicit_substep" => &self.options,
            _ => solver.as_slice(),
        };
        let has_procedural =
            module.starts_with("explicit_substep") || module == "procedural_forces";
        let procedural = self.procedural.as_deref().filter(|_| has_procedural);
        let target = Target { double: T::DOUBLE, fast: self.fast, options, procedural };
        let kernel = self.queue.device.kernel(source, &target, name)?;
        self.kernels.insert((module, name, solver), kernel);
        Ok(kernel)
    }

    /// Forgets what went wrong, and the candidate list.
    pub(crate) fn status_reset(&mut self) -> Result<()> {
        let status = Status {
            non_finite_step: u64::MAX,
            barrier: [0; 2],
            meetings: [0; 2],
            contacts: 0,
            candidates: 0,
            overflow: 0,
            group_overflow: 0,
            rebuilds: 0,
            built: 0,
            stale: [0; 4],
            large: 0,
            searched: [0; 3],
            taken: [0; 3],
            again: 0,
        };
        self.status.write(&self.queue, 0, &[status])
    }

    pub(crate) fn status_read(&self) -> Result<Status> {
        let mut status = Vec::new();
        self.status.read(&self.queue, &mut status)?;
        Ok(status[0])
    }

    /// Writes to an array that grows when it must.
    pub(crate) fn grow_write<E: bytemuck::Pod>(
        queue: &Queue,
        buffer: &mut Buffer<E>,
        entries: &[E],
    ) -> Result<()> {
        if buffer.len() < entries.len() {
            queue.synchronize()?;
            *buffer = Buffer::zeros(queue, entries.len().next_power_of_two())?;
        }
        buffer.write(queue, 0, entries)
    }

    /// Whether the module of whole frames can leave the state that a frame begins with as it is.
    pub(crate) fn frame_keeps_first(&self) -> bool {
        ["explicit_substep_contact", "explicit_substep_flat"].contains(&self.frame_module)
    }

    /// Whether the module of whole frames counts the pairs that each frame looks at; others have lists whose pairs were counted when they
    /// were built.
    pub(crate) fn frame_counts_candidates(&self) -> bool {
        self.frame_module == "explicit_substep_contact"
    }

    /// After a launch that left motion `first` as it is: that is the saved one now, and what was saved has the state that stood in
    /// for it.
    pub(crate) fn motion_exchange(&mut self, first: usize, saved: &mut [Buffer<Real4<T>>; 2]) {
        let [position, velocity] = saved;
        std::mem::swap(&mut self.position[first], position);
        std::mem::swap(&mut self.velocity[first], velocity);
        let [a, b] = self.position.each_ref().map(Buffer::address);
        self.data.position = [a, b, 0];
        let [a, b] = self.velocity.each_ref().map(Buffer::address);
        self.data.velocity = [a, b, 0];
    }

    /// Makes the other motion the present one.
    pub(crate) fn swap(&mut self) {
        self.data.present = 1 - self.data.present;
    }

    /// Index of the present motion.
    pub(crate) const fn present(&self) -> usize {
        self.data.present as usize
    }
}
