//! The device memory of a solver: every buffer by the name that kernels know it by.

use std::collections::HashMap;

use cloth_core::{Error, Model, Result, fabric::FOLDS};
use wgpu::util::DeviceExt;

use crate::{
    contact::policy::{COVER_MAX, ContactSizes},
    device::DeviceContext,
    dispatch::MEASURE_BLOCK,
    fault::{BACKEND, fault},
    layout::{Collider, Pin, Status, Substep},
    tables::Tables,
};

/// Copies of the motion of all particles. Two take turns; frames that may have to be done again need a third, in which the start
/// of a frame is kept until the frame is known to be good, and a fourth if the device is asked for some frames while it does others.
const MOTIONS: [&str; MOTIONS_MAX] = ["motion 0", "motion 1", "motion 2", "motion 3"];

/// Most copies of the motion.
pub(crate) const MOTIONS_MAX: usize = 4;

/// All buffers of a solver.
#[derive(Debug)]
pub(crate) struct Buffers {
    named: HashMap<&'static str, wgpu::Buffer>,
    positions: Vec<wgpu::Buffer>,
    velocities: Vec<wgpu::Buffer>,
    /// The boxes around groups at these positions.
    boxes: Vec<wgpu::Buffer>,
    /// The particles of groups at these positions, side by side, in the form for few groups.
    /// Bytes taken so far.
    bytes: u64,
}

/// Bytes of a position or velocity.
pub(crate) const VECTOR_SIZE: u64 = 16;

/// What is going to be made: name, size \[byte\], initial contents.
struct Plan<'a>(Vec<(&'static str, u64, Option<&'a [u8]>)>);

impl<'a> Plan<'a> {
    fn of(model: &Model, tables: &'a Tables, contact: Option<&ContactSizes>) -> Self {
        let particles = model.particle_count() as u64;
        let mut plan = Self(Vec::new());
        plan.zeroed("model", size_of::<crate::layout::Model>() as u64);
        plan.zeroed("status", size_of::<Status>() as u64);
        plan.zeroed("force", VECTOR_SIZE * particles);
        plan.zeroed("normals", VECTOR_SIZE * particles);
        plan.zeroed("colliders", size_of::<Collider>() as u64);
        plan.zeroed("pins", pins_size(1));
        plan.zeroed("control_forces", 16 + size_of::<crate::layout::ControlForce>() as u64);
        let elements = model.elements().triangles().len() as u64;
        let blocks = [particles, elements].map(|count| count.div_ceil(u64::from(MEASURE_BLOCK)));
        let blocks = blocks[0] + blocks[1];
        plan.zeroed("measure_partials", MEASURE_SIZE * blocks);
        plan.zeroed("measure_result", MEASURE_SIZE);
        plan.filled("spring_rows", bytemuck::cast_slice(&tables.spring_rows));
        plan.filled("spring_entries", bytemuck::cast_slice(&tables.spring_entries));
        plan.filled("triangle_rows", bytemuck::cast_slice(&tables.triangle_rows));
        plan.filled("triangles", bytemuck::cast_slice(&tables.triangles));
        plan.filled("air_cloths", bytemuck::cast_slice(&tables.air_cloths));
        plan.filled("offsets", bytemuck::cast_slice(&tables.offsets));
        plan.filled("limited_springs", bytemuck::cast_slice(&tables.strain.springs));
        plan.filled("limited_triangles", bytemuck::cast_slice(&tables.strain.triangles));
        plan.filled("distance_grids", bytemuck::cast_slice(&tables.distance_grids));
        if elements > 0 {
            plan.filled("fabric_elements", bytemuck::cast_slice(&tables.fabric.elements));
            plan.filled("fabric_laws", bytemuck::cast_slice(&tables.fabric.laws));
            plan.filled("fabric_rows", bytemuck::cast_slice(&tables.fabric.rows));
            let folds = model.elements().folds().len() as u64;
            let (corners, vertices) = (3 * elements, 4 * folds);
            plan.zeroed("fabric_vectors", VECTOR_SIZE * (corners + vertices));
            plan.filled("fold_tables", bytemuck::cast_slice(&tables.fabric.folds));
            plan.zeroed("fold_numbers", 4 * (10 * (folds + 1) + FOLDS as u64 * elements + 1));
        }
        if model.collider_impulses() {
            let colliders = model.colliders().len() as u64;
            for name in
                ["collider_impulses", "collider_impulses_kept", "collider_impulses_of_frame"]
            {
                plan.zeroed(name, impulses_size(model));
            }
            plan.zeroed("impulse_partials", IMPULSE_SIZE * blocks * colliders);
        }
        if let Some(sizes) = contact {
            plan.zeroed("contact", size_of::<crate::layout::Contact>() as u64);
            plan.filled("group_members", bytemuck::cast_slice(&tables.group_members));
            plan.zeroed("group_rows", VECTOR_SIZE * sizes.row_words());
            plan.zeroed("cell_heads", 2 * 4 * u64::from(sizes.cells));
            plan.zeroed("cell_nodes", 8 * u64::from(COVER_MAX * sizes.groups));
            plan.zeroed("contact_rows", 8 * particles);
            plan.zeroed("contact_entries", 4 * u64::from(sizes.entries));
            plan.zeroed("contact_counts", 4 * particles);
            plan.filled("exclusions", bytemuck::cast_slice(&tables.exclusions));
        }
        plan
    }

    fn zeroed(&mut self, name: &'static str, size: u64) {
        self.0.push((name, size, None));
    }

    fn filled(&mut self, name: &'static str, contents: &'a [u8]) {
        self.0.push((name, contents.len() as u64, Some(contents)));
    }
}

/// Bytes of one set of results of the stage `measure`.
pub(crate) const MEASURE_SIZE: u64 = 128;

/// Bytes of one sum of the impulses of a collider, with what it lost to rounding.
pub(crate) const IMPULSE_SIZE: u64 = 64;

/// Bytes of what every collider did to every particle.
pub(crate) fn impulses_size(model: &Model) -> u64 {
    2 * VECTOR_SIZE * model.particle_count() as u64 * model.colliders().len() as u64
}

/// Bytes of `count` pins with their header.
pub(crate) const fn pins_size(count: usize) -> u64 {
    16 + (count * size_of::<Pin>()) as u64
}

/// Distance of two entries of an array of uniforms \[byte\].
pub(crate) fn uniform_stride(limits: &wgpu::Limits, size: usize) -> u64 {
    (size as u64).next_multiple_of(u64::from(limits.min_uniform_buffer_offset_alignment))
}

impl Buffers {
    /// Takes all memory for a model.
    ///
    /// # Errors
    /// `LimitExceeded` before anything is taken, if a buffer is larger than the device allows;
    /// `OutOfMemory`.
    pub(crate) fn new(
        context: &DeviceContext,
        model: &Model,
        tables: &Tables,
        contact: Option<&ContactSizes>,
        motions: usize,
    ) -> Result<Self> {
        let plan = Plan::of(model, tables, contact);
        let motion = VECTOR_SIZE * model.particle_count() as u64;
        for &(name, size, _) in &plan.0 {
            size_check(&context.limits, name, size)?;
        }
        size_check(&context.limits, "positions", motion)?;
        let mut buffers = Self {
            named: HashMap::new(),
            positions: vec![],
            velocities: vec![],
            boxes: vec![],
            bytes: 0,
        };
        for (name, size, contents) in plan.0 {
            buffers.create(context, name, size, contents)?;
        }
        let colours = uniform_array(&context.limits, &tables.strain.colours);
        buffers.create(context, "colour", colours.len() as u64, Some(&colours))?;
        buffers.create(
            context,
            "substep",
            uniform_stride(&context.limits, size_of::<Substep>()),
            None,
        )?;
        for label in &MOTIONS[..motions] {
            let position = buffers.allocate(context, label, motion, None)?;
            let velocity = buffers.allocate(context, label, motion, None)?;
            buffers.positions.push(position);
            buffers.velocities.push(velocity);
            if let Some(sizes) = contact {
                let size = 2 * VECTOR_SIZE * u64::from(sizes.groups);
                let boxes = buffers.allocate(context, "boxes of groups", size, None)?;
                buffers.boxes.push(boxes);
            }
        }
        Ok(buffers)
    }

    /// Makes a buffer, or makes it anew; contents are lost.
    ///
    /// # Errors
    /// `LimitExceeded`, `OutOfMemory`.
    pub(crate) fn create(
        &mut self,
        context: &DeviceContext,
        name: &'static str,
        size: u64,
        contents: Option<&[u8]>,
    ) -> Result<()> {
        // The old one goes first, so that both need not fit.
        if let Some(old) = self.named.remove(name) {
            self.bytes -= old.size();
        }
        let buffer = self.allocate(context, name, size, contents)?;
        self.named.insert(name, buffer);
        Ok(())
    }

    fn allocate(
        &mut self,
        context: &DeviceContext,
        name: &'static str,
        size: u64,
        contents: Option<&[u8]>,
    ) -> Result<wgpu::Buffer> {
        size_check(&context.limits, name, size)?;
        // wgpu knows no empty bindings.
        let size = size.max(VECTOR_SIZE);
        let uniform =
            ["model", "substep", "colour", "contact", "call", "pair_task"].contains(&name);
        let kind = if uniform { wgpu::BufferUsages::UNIFORM } else { wgpu::BufferUsages::STORAGE };
        let usage = kind | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
        let contents = contents.filter(|contents| !contents.is_empty());
        let made = context.scoped(wgpu::ErrorFilter::OutOfMemory, |device| match contents {
            Some(contents) => device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(name),
                contents,
                usage,
            }),
            None => device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size,
                usage,
                mapped_at_creation: false,
            }),
        });
        let buffer = made.map_err(|error| fault(&error, self.bytes + size, self.bytes))?;
        context.faults.check()?;
        self.bytes += size;
        Ok(buffer)
    }

    /// The buffer that a kernel knows as `name`, when it reads motion `input` and writes `output`.
    ///
    /// # Errors
    /// A name that no buffer has: an error of this crate, which its tests exclude.
    pub(crate) fn get(&self, name: &str, input: usize, output: usize) -> Result<&wgpu::Buffer> {
        let found = match name {
            "position_in" => self.positions.get(input),
            "velocity_in" => self.velocities.get(input),
            "position_out" => self.positions.get(output),
            "velocity_out" => self.velocities.get(output),
            "group_boxes_in" => self.boxes.get(input),
            "group_boxes_out" => self.boxes.get(output),
            _ => self.named.get(name),
        };
        found.ok_or_else(|| Error::Unsupported {
            backend: BACKEND,
            feature: format!("buffer {name} in a scene that has none"),
        })
    }

    /// Whether there is a buffer of that name.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.named.contains_key(name)
    }

    pub(crate) fn position(&self, motion: usize) -> &wgpu::Buffer {
        &self.positions[motion]
    }

    pub(crate) fn velocity(&self, motion: usize) -> &wgpu::Buffer {
        &self.velocities[motion]
    }

    /// Number of copies of the motion.
    pub(crate) fn motion_count(&self) -> usize {
        self.positions.len()
    }
}

fn size_check(limits: &wgpu::Limits, name: &'static str, size: u64) -> Result<()> {
    let max = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if size > max {
        return Err(Error::LimitExceeded { limit: limit_name(name), requested: size, max });
    }
    Ok(())
}

/// What a user calls the limit on a buffer.
fn limit_name(buffer: &'static str) -> &'static str {
    match buffer {
        "positions" | "force" | "normals" => "bytes of a buffer of particles on this device",
        "spring_rows" | "spring_entries" | "limited_springs" => {
            "bytes of a buffer of springs on this device"
        }
        "triangle_rows" | "triangles" | "fabric_elements" | "fabric_rows" | "fabric_vectors"
        | "fold_tables" | "fold_numbers" => "bytes of a buffer of triangles on this device",
        "colliders"
        | "distance_grids"
        | "collider_impulses"
        | "collider_impulses_kept"
        | "collider_impulses_of_frame"
        | "impulse_partials" => "bytes of a buffer of colliders on this device",
        "vectors" | "matrix_base" | "matrix_diagonal" | "inverse" | "factors" | "link_entries"
        | "constraints" | "fabric_tangents" | "fabric_terms" | "element_sums"
        | "element_entries" | "schwarz_factors" | "schwarz_tables" | "schwarz_vectors" => {
            "bytes of a buffer of the linear system on this device"
        }
        "contact_entries" | "contact_factors" | "contact_table" | "contact_terms"
        | "group_rows" | "pairs" | "pair_results" => {
            "bytes of a buffer of contact candidates on this device"
        }
        _ => "bytes of a buffer on this device",
    }
}

/// An array of uniforms, each at its own aligned place.
pub(crate) fn uniform_array<T: bytemuck::Pod>(limits: &wgpu::Limits, items: &[T]) -> Vec<u8> {
    let stride = uniform_stride(limits, size_of::<T>()) as usize;
    let mut bytes = vec![0; stride * items.len().max(1)];
    for (chunk, item) in bytes.chunks_exact_mut(stride).zip(items) {
        chunk[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(item));
    }
    bytes
}
