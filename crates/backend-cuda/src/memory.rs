//! All memory of one solver on the device, and the kernels that work on it.

use std::{collections::HashMap, sync::Arc};

use cloth_core::{
    ColliderShape, DistanceGrid, Model, Result, SolverConfig, fabric::bending::PATCH,
};
use cloth_kernels::CudaModule;

use crate::{
    compile::Target,
    contact::ContactMemory,
    device::{Device, Kernel},
    forms::FrameForm,
    kernels::ImpulseMemory,
    layout::{
        ColliderData, ControlForceData, CudaReal, GridData, PinData, Real4, SolverData, Status,
        SubstepData,
    },
    procedural,
    queue::{Buffer, Launch, Queue, THREADS},
    solver_form::SolverForm,
    tables::{FabricTables, SpringTables, StrainTables, TriangleTables, spring_kinds},
};

/// Particles of a block of sums, as on the CPU.
pub(crate) const BLOCK: usize = 512;
/// Figures of a block, as `measure.cu` writes them.
pub(crate) const FIGURES: usize = 16;
/// Substeps that are done in one launch at most.
const SUBSTEPS_MAX: usize = 1024;

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
    /// Velocities of an iterate of Newton's method.
    pub(crate) iterate: Option<Buffer<Real4<T>>>,
    /// Positions of the last `iterate_keep`.
    pub(crate) proven: Option<Buffer<Real4<T>>>,
    /// Positions of the last `start_keep`.
    pub(crate) start: Option<Buffer<Real4<T>>>,
    pub(crate) colliders: Buffer<ColliderData<T>>,
    pub(crate) substeps: Buffer<SubstepData<T>>,
    pub(crate) pins: Buffer<PinData<T>>,
    pub(crate) control_forces: Buffer<ControlForceData<T>>,
    pub(crate) status: Buffer<Status>,
    pub(crate) partials: Buffer<f64>,
    pub(crate) contact: Option<ContactMemory<T>>,
    pub(crate) triangles: Option<(Buffer<u32>, Buffer<[u32; 4]>)>,
    pub(crate) springs: SpringTables<T>,
    spring_kinds: Buffer<Real4<T>>,
    pub(crate) colours: Vec<u32>,
    /// For each collider the address of its distance grid, 0 for another shape.
    pub(crate) grids: Vec<u64>,
    pub(crate) impulses: Option<ImpulseMemory>,
    /// The part of kernels that adds the forces of procedural fields, if there are any.
    procedural: Option<String>,
    /// Form and launch of the frame kernel.
    pub(crate) frame_form: FrameForm,
    pub(crate) frame: Launch,
    pub(crate) options: Vec<&'static str>,
    /// Substeps that one launch of it may do.
    pub(crate) substeps_max: usize,
    /// How often it writes to the other motion in a substep.
    pub(crate) motions: u32,
    /// Held by `data` through their addresses.
    pub(crate) tables: Vec<Box<dyn std::any::Any + Send>>,
    pub(crate) progress: Buffer<u64>,
    pub(crate) packets: Buffer<[u32; 4]>,
    kernels: HashMap<(&'static str, &'static str, Option<&'static str>), Kernel>,
    /// How the linear system is solved at present.
    pub(crate) solver: SolverForm,
    /// Blocks that have last met in a linear solver.
    solver_blocks: u32,
    fast: bool,
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
        let spring_kinds = Buffer::of(&queue, &springs.kinds)?;
        data.spring_kinds = spring_kinds.address();
        table!(spring_buckling, &springs.buckling);
        table!(offsets, &offsets);
        table!(air, &air);
        table!(limited_springs, &strain.springs);
        table!(longest, &strain.longest);
        if model.has_fabric() {
            let fabric = FabricTables::<T>::new(model);
            table!(fabric_laws, &fabric.laws);
            table!(membranes, &fabric.membranes);
            table!(patches, &fabric.patches);
            table!(membrane_rows, fabric.rows[0].offsets());
            table!(membrane_entries, fabric.rows[0].entries());
            table!(bending_rows, fabric.rows[1].offsets());
            table!(bending_entries, fabric.rows[1].entries());
            let count = fabric.membranes.len();
            let forces = (
                Buffer::<T>::zeros(&queue, 3 * 3 * count)?,
                Buffer::<T>::zeros(&queue, PATCH * 3 * count)?,
            );
            data.membrane_forces = forces.0.address();
            data.bending_forces = forces.1.address();
            tables.push(Box::new(forces));
            data.element_count = count as u32;
        }
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
            iterate: None,
            proven: None,
            start: None,
            contact: None,
            triangles: None,
            colours: strain.colours.clone(),
            grids,
            impulses,
            procedural: procedural::part::<T>(model),
            frame_form: FrameForm::Pass,
            frame: Launch::over(1),
            options: Vec::new(),
            substeps_max: SUBSTEPS_MAX,
            motions: 1,
            tables,
            kernels: HashMap::new(),
            solver: SolverForm::General,
            solver_blocks: 0,
            fast,
            queue,
            data,
            position,
            velocity,
            force,
            status,
            partials,
            springs,
            spring_kinds,
            progress,
            packets,
        };
        if model.air().is_some() {
            memory.triangles_prepare(model)?;
        }
        let patch = memory.frame_prepare(model, config, &strain)?;
        let points = model.self_contact().filter(|contact| !contact.is_of_triangles());
        if let Some(contact) = points {
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
        let triangles = Buffer::of(&self.queue, &tables.triangles)?;
        self.data.triangle_rows = rows.address();
        self.data.triangles = triangles.address();
        self.triangles = Some((rows, triangles));
        Ok(())
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
            "explicit_substep" | "explicit_substep_stages" => &self.options,
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

    /// Takes the lengths and stiffness of springs from another model.
    ///
    /// # Errors
    /// What the device reports.
    pub(crate) fn spring_kinds_write(&mut self, model: &Model) -> Result<()> {
        self.springs.kinds = spring_kinds(model);
        self.spring_kinds.write(&self.queue, 0, &self.springs.kinds)
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

    /// Sets the counter of the meetings of a linear solver back where another number of blocks comes to them: it has to begin with a
    /// multiple of that.
    pub(crate) fn solver_barrier_prepare(&mut self, blocks: u32) -> Result<()> {
        if self.solver_blocks == blocks {
            return Ok(());
        }
        self.solver_blocks = blocks;
        let second = std::mem::offset_of!(Status, barrier) + size_of::<u64>();
        self.status.clear_bytes(&self.queue, second, size_of::<u64>())
    }

    pub(crate) fn status_read(&self) -> Result<Status> {
        let mut status = Vec::new();
        self.status.read(&self.queue, &mut status)?;
        Ok(status[0])
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
