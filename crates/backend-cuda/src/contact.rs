//! Contact of cloth with itself: sizes of the candidate list, and its memory.
//!
//! The device decides by itself when to build the list (`shared/list.cuh`), and no pair is ever missing. The
//! host only learns after a frame whether a particle had more candidates than there is room for: then the
//! frame is done again from its start, with more room. As results depend on the pairs in contact alone, a
//! frame done again is the frame that should have been.

use cloth_core::{ContactResponse, Error, Model, Result, SelfContact};

use crate::{
    layout::{CudaReal, Real4, SolverData},
    queue::{Buffer, Queue},
};

/// Candidates for each particle at first.
const CAPACITY: u32 = 24;
/// Size of a cell in units of the contact distance.
const CELL: f64 = 4.0;
/// How far a particle may stray from its expected way, in units of the contact distance.
const ALLOWANCE: f64 = 0.6;
/// Share of the reach that rounding cannot use up.
const REACH_SAFETY: f64 = 0.99;
/// Uses that a list is made for, at least and at most.
const HORIZON: [f64; 2] = [2.0, 12.0];
/// A list is made for so many times the uses that lists have lasted.
const HORIZON_SHARE: f64 = 1.4;
/// Uses within which the fastest motion that a list can foresee uses up its reach.
const MOTION_USES: f64 = 2.0;
/// Cells along each axis, so that a cell and its two neighbours differ, and at most.
const CELLS: [u32; 2] = [4, 1 << 12];

/// Memory of the list.
pub(crate) struct ContactMemory<T> {
    response: ContactResponse,
    candidates: Buffer<u32>,
    counts: Buffer<u32>,
    reference: Buffer<Real4<T>>,
    rest: Buffer<Real4<T>>,
    cell_counts: Buffer<u32>,
    cell_starts: Buffer<u32>,
    cell_sums: Buffer<u32>,
    cell_of: Buffer<u32>,
    cell_rank: Buffer<u32>,
    sorted: Buffer<Real4<T>>,
    sorted_index: Buffer<u32>,
    crowd: Buffer<u32>,
    cell_size: f64,
    cell_limit: u32,
    capacity: u32,
    particles: usize,
}

impl<T: CudaReal> ContactMemory<T> {
    /// Memory for a model with self-contact; `blocks` at most build the list together.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(
        queue: &Queue,
        model: &Model,
        contact: &SelfContact,
        blocks: usize,
    ) -> Result<Self> {
        let n = model.particle_count();
        let cell_limit = (2 * n).next_power_of_two().max(64) as u32;
        let rest: Vec<Real4<T>> = if contact.excludes_neighbours() {
            model.positions().iter().map(|x| [x[0], x[1], x[2], 0.0].map(T::from_f64)).collect()
        } else {
            Vec::new()
        };
        Ok(Self {
            response: contact.response,
            candidates: Buffer::zeros(queue, n * CAPACITY as usize)?,
            counts: Buffer::zeros(queue, n)?,
            reference: Buffer::zeros(queue, n)?,
            rest: Buffer::of(queue, &rest)?,
            cell_counts: Buffer::zeros(queue, cell_limit as usize)?,
            cell_starts: Buffer::zeros(queue, cell_limit as usize + 1)?,
            cell_sums: Buffer::zeros(queue, blocks)?,
            cell_of: Buffer::zeros(queue, n)?,
            cell_rank: Buffer::zeros(queue, n)?,
            sorted: Buffer::zeros(queue, n)?,
            sorted_index: Buffer::zeros(queue, n)?,
            crowd: Buffer::zeros(queue, n)?,
            cell_size: CELL * contact.distance,
            cell_limit,
            capacity: CAPACITY,
            particles: n,
        })
    }

    /// Puts addresses and constants in place.
    pub(crate) fn describe(&self, data: &mut SolverData<T>, distance: f64, time_step: f64) {
        data.candidates = self.candidates.address();
        data.candidate_counts = self.counts.address();
        data.reference = self.reference.address();
        data.rest = self.rest.address();
        data.cell_counts = self.cell_counts.address();
        data.cell_starts = self.cell_starts.address();
        data.cell_sums = self.cell_sums.address();
        data.cell_of = self.cell_of.address();
        data.cell_rank = self.cell_rank.address();
        data.sorted = self.sorted.address();
        data.sorted_index = self.sorted_index.address();
        data.crowd = self.crowd.address();
        data.candidate_capacity = self.capacity;
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
        }
        let allowance = ALLOWANCE * distance;
        let reach = 0.5 * (self.cell_size - distance) * REACH_SAFETY;
        data.list_allowance = number(allowance * REACH_SAFETY);
        data.list_reach = number(reach);
        data.cells_per_metre = number(self.cell_size.recip());
        if data.list_horizon == T::ZERO {
            data.list_horizon = number(HORIZON[1]);
        }
        data.list_distance = number(1.001 * (distance + 2.0 * allowance));
        data.list_motion_max = number(reach / MOTION_USES);
        data.time_step = number(time_step);
    }

    /// Uses to make a list for after `uses` of them in which it was built `builds` times: what is foreseen for
    /// longer than it lasts only makes lists long.
    pub(crate) fn horizon(uses: u32, builds: u32) -> f64 {
        let [least, most] = HORIZON;
        let lasted = f64::from(uses) / f64::from(builds.max(1));
        (HORIZON_SHARE * lasted).ceil().clamp(least, most)
    }

    /// Cells for particles within these bounds \[m\]: no more than twice the particles. Beyond, the cells
    /// repeat, which costs only more candidates to reject.
    pub(crate) fn cells(&self, low: [f64; 3], high: [f64; 3]) -> [u32; 3] {
        let [least, most] = CELLS;
        let mut cells = [0, 1, 2].map(|axis| {
            let side = ((high[axis] - low[axis]) / self.cell_size).clamp(0.0, f64::from(most));
            (side as u32 + 2).next_power_of_two().clamp(least, most)
        });
        while cells.iter().map(|&cells| u64::from(cells)).product::<u64>() > self.cell_limit.into()
        {
            let longest = (0..3).max_by_key(|&axis| cells[axis]).unwrap_or(0);
            cells[longest] /= 2;
        }
        cells
    }

    pub(crate) const fn is_penalty(&self) -> bool {
        matches!(self.response, ContactResponse::Penalty { .. })
    }

    /// Room for `needed` candidates of each particle.
    ///
    /// # Errors
    /// `Overflow` if the device has not that much memory.
    pub(crate) fn grow(&mut self, queue: &Queue, needed: u32) -> Result<()> {
        let possible = self.particles.min(needed as usize + needed as usize / 2 + 4);
        let overflow = |_| Error::Overflow {
            buffer: "contact candidates",
            needed: u64::from(needed) * self.particles as u64,
            capacity: u64::from(self.capacity) * self.particles as u64,
        };
        let larger = Buffer::zeros(queue, self.particles * possible).map_err(overflow)?;
        self.candidates = larger;
        self.capacity = possible as u32;
        Ok(())
    }

    /// The list: counts, and candidates by place and particle.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn read(
        &self,
        queue: &Queue,
        counts: &mut Vec<u32>,
        candidates: &mut Vec<u32>,
    ) -> Result<()> {
        self.counts.read(queue, counts)?;
        self.candidates.read(queue, candidates)
    }
}
