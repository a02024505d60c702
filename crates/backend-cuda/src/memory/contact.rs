//! Contact of cloth with itself: groups of particles, the list of groups that may come near each other, and the
//! rows of partners.
//!
//! The device decides by itself when to build the list (`shared/list.cuh`), and no pair is ever missing. The
//! host only learns after a frame whether a particle had more partners, or a group more groups near it, than there
//! is room for: then the frame is done again from its start, with more room. As results depend on the pairs
//! in contact alone, a frame done again is the frame that should have been.

use cloth_core::{ContactResponse, Error, Model, Result, SelfContact};

use crate::{
    layout::{CudaReal, GROUP, Real4, SolverData, Status},
    patch::Patch,
    queue::{Buffer, Queue},
};

/// Partners of each particle, and groups near each group, at first.
const CAPACITY: [u32; 2] = [24, 64];
/// What is added to the region of a group on all sides, in units of the contact distance.
const MARGIN: f64 = 2.0;
/// Uses that regions are made for.
const HORIZON: f64 = 12.0;
/// Cells that a region is put into, as in `shared/build.cuh`.
const COVER_MAX: usize = 27;
/// Chains of cells for each group, at least.
const CHAINS: usize = 4;

/// Memory of contact.
pub(crate) struct ContactMemory<T> {
    response: ContactResponse,
    candidates: Buffer<u32>,
    candidate_counts: Buffer<u32>,
    rest: Buffer<Real4<T>>,
    group_members: Buffer<u32>,
    group_positions: [Buffer<Real4<T>>; 2],
    group_boxes: [Buffer<Real4<T>>; 2],
    group_regions: Buffer<Real4<T>>,
    group_rows: Buffer<u32>,
    group_counts: Buffer<u32>,
    cell_heads: Buffer<u64>,
    cell_nodes: Buffer<[u32; 2]>,
    crowd: Buffer<u32>,
    /// Of the tiles of a patch: regions, what is asked of edges, uses that they were searched at, those that are searched, and
    /// groups that were not flat.
    tile_boxes: Buffer<Real4<T>>,
    tile_flat: Buffer<Real4<T>>,
    tile_marks: Buffer<u32>,
    tile_list: Buffer<u32>,
    tile_rough: Buffer<[u32; 2]>,
    /// Longest side of the groups at rest, on average \[m\].
    group_side: f64,
    groups: usize,
    capacity: [u32; 2],
    particles: usize,
}

impl<T: CudaReal> ContactMemory<T> {
    /// Memory for a model with self-contact; a patch has its tiles divided into groups.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(
        queue: &Queue,
        model: &Model,
        contact: &SelfContact,
        patch: Option<Patch>,
    ) -> Result<Self> {
        let n = model.particle_count();
        let members = patch.map_or_else(|| model.particle_groups(GROUP), |patch| patch.groups());
        let groups = members.len() / GROUP;
        let rest: Vec<Real4<T>> = if contact.excludes_neighbours() {
            model.positions().iter().map(|x| [x[0], x[1], x[2], 0.0].map(T::from_f64)).collect()
        } else {
            Vec::new()
        };
        let pair = |length| -> Result<[Buffer<Real4<T>>; 2]> {
            Ok([Buffer::zeros(queue, length)?, Buffer::zeros(queue, length)?])
        };
        let tiles = patch.map_or(0, |patch| patch.tiles());
        let chains = (CHAINS * groups).next_power_of_two();
        Ok(Self {
            response: contact.response,
            candidates: Buffer::zeros(queue, n * CAPACITY[0] as usize)?,
            candidate_counts: Buffer::zeros(queue, n)?,
            rest: Buffer::of(queue, &rest)?,
            group_positions: pair(groups * GROUP)?,
            group_boxes: pair(2 * groups)?,
            group_regions: Buffer::zeros(queue, 2 * groups)?,
            group_rows: Buffer::zeros(queue, groups * CAPACITY[1] as usize)?,
            group_counts: Buffer::zeros(queue, groups)?,
            cell_heads: Buffer::zeros(queue, chains)?,
            cell_nodes: Buffer::zeros(queue, groups * COVER_MAX)?,
            crowd: Buffer::zeros(queue, n)?,
            tile_boxes: Buffer::zeros(queue, 4 * tiles)?,
            tile_flat: Buffer::zeros(queue, 3 * tiles)?,
            tile_marks: Buffer::zeros(queue, tiles)?,
            tile_list: Buffer::zeros(queue, tiles)?,
            tile_rough: Buffer::zeros(queue, tiles)?,
            group_side: model.group_side(&members, GROUP),
            group_members: Buffer::of(queue, &members)?,
            groups,
            capacity: CAPACITY,
            particles: n,
        })
    }

    /// Puts addresses and constants in place.
    pub(crate) fn describe(&self, data: &mut SolverData<T>, distance: f64, time_step: f64) {
        data.candidates = self.candidates.address();
        data.candidate_counts = self.candidate_counts.address();
        data.rest = self.rest.address();
        data.group_members = self.group_members.address();
        data.group_positions = self.group_positions.each_ref().map(Buffer::address);
        data.group_boxes = self.group_boxes.each_ref().map(Buffer::address);
        data.group_regions = self.group_regions.address();
        data.group_rows = self.group_rows.address();
        data.group_counts = self.group_counts.address();
        data.cell_heads = self.cell_heads.address();
        data.cell_nodes = self.cell_nodes.address();
        data.crowd = self.crowd.address();
        data.tile_boxes = self.tile_boxes.address();
        data.tile_flat = self.tile_flat.address();
        data.tile_marks = self.tile_marks.address();
        data.tile_list = self.tile_list.address();
        data.tile_rough = self.tile_rough.address();
        data.group_count = self.groups as u32;
        data.cell_mask = self.cell_heads.len() as u32 - 1;
        [data.candidate_capacity, data.group_capacity] = self.capacity;
        let number = T::from_f64;
        data.contact_distance = number(distance);
        match self.response {
            ContactResponse::Penalty { stiffness, damping } => {
                data.contact = 1;
                data.contact_stiffness = number(stiffness);
                data.contact_damping = number(damping);
            }
            ContactResponse::Impulse { restitution, friction } => {
                data.contact = 2;
                data.contact_restitution = number(restitution);
                data.contact_friction = number(friction);
            }
            // It has memory of its own.
            ContactResponse::Triangles { .. } => {}
        }
        let margin = MARGIN * distance;
        data.list_margin = number(margin);
        data.list_horizon = number(HORIZON * time_step);
        // Most regions then touch two cells along each axis at most.
        data.cells_per_metre = number((self.group_side + 2.0 * margin + distance).recip());
    }

    pub(crate) const fn is_penalty(&self) -> bool {
        matches!(self.response, ContactResponse::Penalty { .. })
    }

    /// Room for what did not fit.
    ///
    /// # Errors
    /// `Overflow` if the device has not that much memory.
    pub(crate) fn grow(&mut self, queue: &Queue, status: &Status) -> Result<()> {
        let room = |needed: u32, most: usize| most.min(needed as usize + needed as usize / 2 + 4);
        let overflow = |buffer, needed: u32, capacity: u32, rows: usize| Error::Overflow {
            buffer,
            needed: u64::from(needed) * rows as u64,
            capacity: u64::from(capacity) * rows as u64,
        };
        let [partners, near] = &mut self.capacity;
        if status.overflow > 0 {
            let possible = room(status.overflow, self.particles);
            self.candidates = Buffer::zeros(queue, self.particles * possible).map_err(|_| {
                overflow("contact candidates", status.overflow, *partners, self.particles)
            })?;
            *partners = possible as u32;
        }
        if status.group_overflow > 0 {
            let possible = room(status.group_overflow, self.groups);
            self.group_rows = Buffer::zeros(queue, self.groups * possible).map_err(|_| {
                overflow("groups near each other", status.group_overflow, *near, self.groups)
            })?;
            *near = possible as u32;
        }
        Ok(())
    }

    /// The rows: counts, and partners by place and particle.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn read(
        &self,
        queue: &Queue,
        counts: &mut Vec<u32>,
        candidates: &mut Vec<u32>,
    ) -> Result<()> {
        self.candidate_counts.read(queue, counts)?;
        self.candidates.read(queue, candidates)
    }
}
