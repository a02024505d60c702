//! The state of all particles: writing, reading, taking turns.

use cloth_core::{Collider, ColliderShape, PinWrite, Result, State, stepper::ColliderState};

use super::Stages;
use crate::{
    buffers::{VECTOR_SIZE, pins_size},
    dispatch::WORKGROUP,
    layout::{self, STOPPED_NEVER, Status},
    readback::Readback,
};

/// What stands for a body in contact of triangles where kernels read colliders: a plane far below everything.
pub(super) fn body() -> layout::Collider {
    layout::Collider {
        translation: [0.0, 0.0, FAR_BELOW],
        row_x: [1.0, 0.0, 0.0],
        row_y: [0.0, 1.0, 0.0],
        row_z: [0.0, 0.0, 1.0],
        ..layout::Collider::default()
    }
}

/// A collider at one time, as kernels read it; `grid` is the number of its distance grid.
pub(super) fn collider(collider: &Collider, grid: f32, at: &ColliderState) -> layout::Collider {
    let single = |vector: [f64; 3]| vector.map(|component| component as f32);
    let [row_x, row_y, row_z] = at.rotation.map(single);
    let (shape, sizes) = match &collider.shape {
        ColliderShape::Plane => (0, [0.0; 3]),
        &ColliderShape::Sphere { radius } => (1, [radius, 0.0, 0.0]),
        &ColliderShape::Capsule { half_length, radius } => (2, [half_length, radius, 0.0]),
        &ColliderShape::Box { half_extents } => (3, half_extents),
        // It is for contact of triangles alone, where it is a body.
        ColliderShape::Surface(_) => (0, [0.0; 3]),
        ColliderShape::Grid(_) => (4, [f64::from(grid), f64::from(at.sets.index), at.sets.share]),
    };
    let [size_x, size_y, size_z] = single(sizes);
    layout::Collider {
        translation: single(at.translation),
        shape,
        linear_velocity: single(at.linear_velocity),
        friction: collider.friction as f32,
        angular_velocity: single(at.angular_velocity),
        restitution: collider.restitution as f32,
        row_x,
        size_x,
        row_y,
        size_y,
        row_z,
        size_z,
    }
}

/// Where nothing is \[m\].
const FAR_BELOW: f32 = -1e30;

/// The copy of velocities that `velocity_keep` makes.
const ITERATE: &str = "velocity_iterate";

/// The copy of positions and velocities that `state_keep` makes.
pub(super) const KEPT: [&str; 2] = ["position_kept", "velocity_kept"];

/// The copy of positions that `iterate_keep` makes.
pub(super) const PROVEN: &str = "position_proven";

/// Most bytes of several buffers that are read together.
const TOGETHER_MAX: u64 = 1 << 26;

/// The copy of positions that `start_keep` makes.
pub(super) const START: &str = "position_start";

impl Stages {
    pub(crate) fn state_write(&mut self, state: &State) -> Result<()> {
        state.validate(&self.model)?;
        self.schwarz_forget();
        // Whatever was under way is overwritten.
        self.open = None;
        self.failure = None;
        self.recorder.submit(&self.context)?;
        self.present = 0;
        self.has_start = false;
        self.has_boxes.fill(false);
        let count = state.positions.len();
        let mut vectors: Vec<[f32; 4]> = Vec::with_capacity(count);
        for (particle, position) in state.positions.iter().enumerate() {
            self.held[particle] = state.held[particle] != 0;
            let [x, y, z] = position.map(|component| component as f32);
            vectors.push([x, y, z, self.inverse_mass(particle)]);
        }
        let queue = &self.context.queue;
        queue.write_buffer(self.buffers.position(0), 0, bytemuck::cast_slice(&vectors));
        vectors.clear();
        let masses = self.model.masses();
        vectors.extend(state.velocities.iter().zip(masses).map(|(velocity, &mass)| {
            let [x, y, z] = velocity.map(|component| component as f32);
            [x, y, z, mass as f32]
        }));
        queue.write_buffer(self.buffers.velocity(0), 0, bytemuck::cast_slice(&vectors));
        self.semi_implicit.held_changed();
        if let Some(triangles) = &mut self.triangles {
            triangles.state_given(&self.model, state);
        }
        self.slots.restart(state.time);
        self.status_reset(STOPPED_NEVER)?;
        self.solve_log_reset()?;
        self.deferred = cloth_core::DeferredOutcome::default();
        self.constrained = Some(0);
        self.released = 0;
        self.rebuilds_reported = 0;
        self.figures = None;
        if let Some(policy) = &mut self.contact {
            policy.changed = true;
        }
        self.contact_constants_write()
    }

    /// Forgets what the device decided, but for the substep that stopped it.
    pub(super) fn status_reset(&mut self, stopped: u32) -> Result<()> {
        self.status = Status { stopped, broken: STOPPED_NEVER, ..Status::default() };
        let status = self.status;
        self.list_uses = 0;
        self.write("status", 0, bytemuck::bytes_of(&status))?;
        if self.buffers.has("cell_heads") {
            // Which of the two tables is clear is forgotten with the number of builds.
            let heads = self.buffers.get("cell_heads", 0, 0)?;
            self.recorder.clear(&self.context, heads);
        }
        Ok(())
    }

    /// 1/m \[1/kg\], 0 while the particle is held.
    fn inverse_mass(&self, particle: usize) -> f32 {
        if self.held[particle] { 0.0 } else { self.model.masses()[particle].recip() as f32 }
    }

    pub(crate) fn state_read(&mut self, out: &mut State) -> Result<()> {
        self.settle()?;
        let count = self.model.particle_count();
        let size = VECTOR_SIZE * count as u64;
        let [position, velocity] =
            [self.buffers.position(self.present), self.buffers.velocity(self.present)];
        let [position, velocity] = [position.clone(), velocity.clone()];
        let State { positions, velocities, held, slips, ghosts, .. } = out;
        self.read_vectors(&[&position, &velocity], size, |part, vectors| {
            let target = if part == 0 { &mut *positions } else { &mut *velocities };
            collect(target, vectors);
        })?;
        held.clear();
        held.extend(self.held.iter().map(|&held| u8::from(held)));
        self.slips_read(slips);
        self.ghosts_read(ghosts);
        Ok(())
    }

    pub(crate) fn forces_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.settle()?;
        let force = self.buffers.get("force", 0, 0)?.clone();
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        self.read_vectors(&[&force], size, |_, vectors| collect(out, vectors))
    }

    pub(crate) fn vertex_normals_read(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.vertex_normals()?;
        let normals = self.buffers.get("normals", 0, 0)?.clone();
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        self.read_vectors(&[&normals], size, |_, vectors| collect(out, vectors))
    }

    /// Computes the normals of the present state on the device.
    pub(crate) fn vertex_normals(&mut self) -> Result<()> {
        self.settle()?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch("vertex_normals", "vertex_normals", items, self.present, (0, 0))
    }

    /// Reads buffers of vectors, `size` bytes each: together, as each time that the host waits costs more than what is read, if that is not more than a
    /// buffer can hold.
    pub(super) fn read_vectors(
        &mut self,
        sources: &[&wgpu::Buffer],
        size: u64,
        mut take: impl FnMut(usize, &[u8]),
    ) -> Result<()> {
        let total = size * sources.len() as u64;
        if total > TOGETHER_MAX || total == 0 {
            for (part, source) in sources.iter().enumerate() {
                self.read_part(source, 0, size, |bytes| take(part, bytes))?;
            }
            return Ok(());
        }
        self.large_ensure(total);
        let Some(large) = &self.large else { return Ok(()) };
        for (part, source) in sources.iter().enumerate() {
            self.recorder.copy(&self.context, source, 0, large.buffer(), part as u64 * size, size);
        }
        self.recorder.submit(&self.context)?;
        large.read(&self.context, total, |bytes| {
            let parts = bytes.chunks_exact(size as usize).enumerate();
            parts.for_each(|(part, bytes)| take(part, bytes));
        })
    }

    /// Makes room for `size` bytes that are read.
    fn large_ensure(&mut self, size: u64) {
        if self.large.as_ref().is_none_or(|large| large.buffer().size() < size) {
            self.large = Some(Readback::new(&self.context, size));
        }
    }

    /// Reads `size` bytes of a buffer.
    pub(super) fn read_part(
        &mut self,
        source: &wgpu::Buffer,
        offset: u64,
        size: u64,
        take: impl FnOnce(&[u8]),
    ) -> Result<()> {
        self.large_ensure(size);
        let Some(large) = &self.large else { return Ok(()) };
        self.recorder.copy(&self.context, source, offset, large.buffer(), 0, size);
        self.recorder.submit(&self.context)?;
        large.read(&self.context, size, take)
    }

    /// Records changes to single particles.
    pub(super) fn pins_write(&mut self, pins: &[PinWrite]) -> Result<()> {
        // Later entries win: threads come in any order.
        let mut last = std::collections::BTreeMap::new();
        for pin in pins {
            let merged = last.entry(pin.particle).or_insert(*pin);
            merged.held = pin.held;
            merged.position = pin.position.or(merged.position);
            merged.velocity = pin.velocity.or(merged.velocity);
        }
        let mut contents = vec![0; pins_size(0) as usize];
        contents[..4].copy_from_slice(&(last.len() as u32).to_ne_bytes());
        for pin in last.values() {
            if std::mem::replace(&mut self.held[pin.particle as usize], pin.held) != pin.held {
                self.semi_implicit.held_changed();
            }
            let [x, y, z] = pin.position.unwrap_or_default().map(|component| component as f32);
            let data = layout::Pin {
                position: [x, y, z, self.inverse_mass(pin.particle as usize)],
                velocity: pin.velocity.unwrap_or_default().map(|component| component as f32),
                particle: pin.particle,
                has_position: u32::from(pin.position.is_some()),
                has_velocity: u32::from(pin.velocity.is_some()),
                ..layout::Pin::default()
            };
            contents.extend_from_slice(bytemuck::bytes_of(&data));
        }
        if last.is_empty() {
            return Ok(());
        }
        // Where they are put may be far away.
        self.list_uses = 0;
        self.write_growing("pins", &contents)?;
        self.in_place()?;
        let items = (last.len() as u32, WORKGROUP);
        self.dispatch("pins_write", "pins_write", items, self.present, (0, 0))
    }

    /// Records a copy of the present motion.
    pub(super) fn state_keep(&mut self) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        for name in KEPT {
            if self.buffers.get(name, 0, 0).is_err() {
                self.buffers.create(&self.context, name, size, None)?;
            }
        }
        if let Some(triangles) = &mut self.triangles {
            triangles.keep();
        }
        self.impulses_copy(["collider_impulses", "collider_impulses_kept"])?;
        self.kept_copy(true)
    }

    /// Records a copy of the present positions, for colliders.
    pub(super) fn start_keep(&mut self) -> Result<()> {
        if let Some(triangles) = &mut self.triangles {
            triangles.start_keep();
        }
        self.has_start = true;
        self.positions_copy(START)
    }

    /// Records a copy of the positions that are proven to be reached.
    pub(super) fn iterate_keep(&mut self) -> Result<()> {
        let Some(triangles) = &mut self.triangles else { return Ok(()) };
        triangles.iterate_keep();
        self.positions_copy(PROVEN)
    }

    fn positions_copy(&mut self, name: &'static str) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        if self.buffers.get(name, 0, 0).is_err() {
            self.buffers.create(&self.context, name, size, None)?;
            self.bind_groups.clear();
        }
        let present = self.buffers.position(self.present);
        let copy = self.buffers.get(name, 0, 0)?;
        self.recorder.copy(&self.context, present, 0, copy, 0, size);
        Ok(())
    }

    /// Records the way back.
    pub(super) fn state_restore(&mut self) -> Result<()> {
        self.in_place()?;
        self.list_uses = 0;
        if let Some(triangles) = &mut self.triangles {
            triangles.restore();
        }
        self.impulses_copy(["collider_impulses_kept", "collider_impulses"])?;
        self.kept_copy(false)
    }

    fn kept_copy(&mut self, keeps: bool) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        let present = [self.buffers.position(self.present), self.buffers.velocity(self.present)];
        for (name, present) in KEPT.into_iter().zip(present) {
            let kept = self.buffers.get(name, 0, 0)?;
            let (from, to) = if keeps { (present, kept) } else { (kept, present) };
            self.recorder.copy(&self.context, from, 0, to, 0, size);
        }
        Ok(())
    }

    /// Records a copy of the present velocities, or takes them back to it.
    pub(super) fn iterate_copy(&mut self, keeps: bool) -> Result<()> {
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        if self.buffers.get(ITERATE, 0, 0).is_err() {
            self.buffers.create(&self.context, ITERATE, size, None)?;
        }
        let present = self.buffers.velocity(self.present);
        let kept = self.buffers.get(ITERATE, 0, 0)?;
        let (from, to) = if keeps { (present, kept) } else { (kept, present) };
        self.recorder.copy(&self.context, from, 0, to, 0, size);
        Ok(())
    }

    /// A motion that may be overwritten: neither the present one nor one that is kept.
    pub(super) fn free_motion(&self) -> usize {
        let mut motions = 0..self.buffers.motion_count();
        motions.find(|&motion| motion != self.present && !self.is_kept(motion)).unwrap_or(0)
    }

    /// Whether open frames may begin with a motion.
    fn is_kept(&self, motion: usize) -> bool {
        self.open.as_ref().is_some_and(|open| {
            let asked = open.question.as_ref().map(|question| question.motion);
            motion == open.start || Some(motion) == asked
        })
    }

    /// Makes sure that the present motion may be changed in place.
    pub(super) fn in_place(&mut self) -> Result<()> {
        if !self.is_kept(self.present) {
            self.has_boxes[self.present] = false;
            return Ok(());
        }
        let target = self.free_motion();
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        let buffers = &self.buffers;
        for (from, to) in [
            (buffers.position(self.present), buffers.position(target)),
            (buffers.velocity(self.present), buffers.velocity(target)),
        ] {
            self.recorder.copy(&self.context, from, 0, to, 0, size);
        }
        self.present = target;
        self.has_boxes[target] = false;
        Ok(())
    }
}

/// The first three of each four numbers.
pub(super) fn collect(out: &mut Vec<[f64; 3]>, bytes: &[u8]) {
    let vectors: &[[f32; 4]] = bytemuck::cast_slice(bytes);
    out.clear();
    out.extend(vectors.iter().map(|&[x, y, z, _]| [x, y, z].map(f64::from)));
}
