//! Memory of contact of triangles, as `shared/triangles.cuh` and `shared/contact_rows.cuh` lay it out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    Error, Result,
    contact::{
        ContactAction, ContactEquation, ContactSet, ContactState,
        device::{DeviceContact, MOVED_NUMBERS, PAIR_WORDS, PAIRS_MAX, PairAnswer, PairTask},
    },
};

use rayon::prelude::*;

use crate::{
    layout::{CudaReal, Real4},
    queue::{Buffer, Queue, Staged},
};

/// The second argument of the kernels that find pairs.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct TrianglePairs<T> {
    pub(crate) task: PairTask<T>,
    surface: u64,
    ways: u64,
    references: u64,
    boxes: u64,
    list: u64,
    counts: u64,
    found: u64,
    moved: u64,
}

/// A contact, and what it does.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct ContactData<T> {
    particles: [u32; 4],
    weights: [T; 4],
    rows: [T; 6],
    force: [T; 3],
    carried: [T; 3],
}

// SAFETY: numbers alone, without padding in either precision (tested below).
unsafe impl<T: CudaReal> Zeroable for ContactData<T> {}
// SAFETY: as above.
unsafe impl<T: CudaReal> Pod for ContactData<T> {}

/// Where the contacts are.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct ContactTable {
    offsets: u64,
    places: u64,
    contacts: u64,
    ranks: u64,
    pub(crate) terms: u64,
    count: u32,
    pub(crate) place_count: u32,
}

/// Contacts that a thread of the host puts in words, at least.
const TASK: usize = 256;

/// Words of a pair.
pub(crate) type PairData = [u32; PAIR_WORDS];

/// Memory of contact of triangles.
pub(crate) struct TriangleMemory<T> {
    surface: Buffer<u32>,
    pub(crate) ways: Buffer<Real4<T>>,
    pub(crate) references: Buffer<Real4<T>>,
    /// Two boxes each, for both sets of positions.
    boxes: Buffer<[[T; 6]; 2]>,
    pub(crate) list: Buffer<PairData>,
    /// What the host asks for, side by side so that it is read at once: how many pairs were found and are in the list, how far particles have moved,
    /// the pairs that were found.
    pub(crate) results: Buffer<u32>,
    offsets: Staged<u32>,
    places: Staged<u32>,
    contacts: Staged<ContactData<T>>,
    /// Where the place of each particle of each contact is.
    ranks: Buffer<u32>,
    /// What a solve adds up, for each place.
    terms: Buffer<Real4<T>>,
    /// Contacts, and their places.
    counts: [u32; 2],
    /// Whether solves work out all contacts before they add up rows.
    is_crowded: bool,
}

/// Words of the counts of the results.
const COUNTS: usize = 4;

/// So many pairs, if an array can have them.
fn pairs(count: u32) -> Result<usize> {
    let overflow = || Error::Overflow {
        buffer: "pairs of triangles that may touch",
        needed: u64::from(count),
        capacity: u64::from(PAIRS_MAX),
    };
    if count <= PAIRS_MAX { Ok(count as usize) } else { Err(overflow()) }
}

impl<T: CudaReal> TriangleMemory<T> {
    /// Memory for contact.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue, contact: &DeviceContact<T>) -> Result<Self> {
        let task = &contact.list.task;
        let nodes = task.node_count as usize;
        Ok(Self {
            surface: Buffer::of(queue, &contact.surface_words())?,
            ways: Buffer::zeros(queue, 2 * nodes)?,
            references: Buffer::zeros(queue, 2 * nodes)?,
            boxes: Buffer::zeros(queue, contact.box_count())?,
            list: Buffer::zeros(queue, pairs(task.pair_capacity)?)?,
            results: Self::results_of(queue, task)?,
            offsets: Staged::new(queue)?,
            places: Staged::new(queue)?,
            contacts: Staged::new(queue)?,
            ranks: Buffer::zeros(queue, 0)?,
            terms: Buffer::zeros(queue, 0)?,
            counts: [0; 2],
            is_crowded: false,
        })
    }

    /// Words before the pairs of the results.
    pub(crate) const fn result_head(task: &PairTask<T>) -> usize {
        let moved = 2 * MOVED_NUMBERS * task.moved_blocks as usize;
        COUNTS + moved * size_of::<T>() / size_of::<u32>()
    }

    fn results_of(queue: &Queue, task: &PairTask<T>) -> Result<Buffer<u32>> {
        let words = Self::result_head(task) + PAIR_WORDS * pairs(task.found_capacity)?;
        Buffer::zeros(queue, words)
    }

    /// Finds what a look has found in the words of the results.
    pub(crate) fn answer(task: &PairTask<T>, out: &mut PairAnswer<T>) {
        let head = Self::result_head(task);
        out.found = out.words[0];
        out.moved.resize(2 * MOVED_NUMBERS * task.moved_blocks as usize, T::ZERO);
        bytemuck::cast_slice_mut(&mut out.moved).copy_from_slice(&out.words[COUNTS..head]);
        let count = out.found.min(task.found_capacity) as usize;
        out.pairs = head..head + PAIR_WORDS * count;
    }

    /// What kernels are given.
    pub(crate) const fn data(&self, task: PairTask<T>) -> TrianglePairs<T> {
        let (counts, word) = (self.results.address(), size_of::<u32>() as u64);
        TrianglePairs {
            task,
            surface: self.surface.address(),
            ways: self.ways.address(),
            references: self.references.address(),
            boxes: self.boxes.address(),
            list: self.list.address(),
            counts,
            found: counts + word * Self::result_head(&task) as u64,
            moved: counts + word * COUNTS as u64,
        }
    }

    /// Makes room for the list.
    ///
    /// # Errors
    /// `Overflow`, `OutOfMemory`.
    pub(crate) fn list_create(&mut self, queue: &Queue, count: u32) -> Result<()> {
        queue.synchronize()?;
        self.list = Buffer::zeros(queue, pairs(count)?)?;
        Ok(())
    }

    /// Makes room for pairs that are found.
    ///
    /// # Errors
    /// `Overflow`, `OutOfMemory`.
    pub(crate) fn results_create(&mut self, queue: &Queue, task: &PairTask<T>) -> Result<()> {
        queue.synchronize()?;
        self.results = Self::results_of(queue, task)?;
        Ok(())
    }

    /// Hands the contacts to the device.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn contacts_write(
        &mut self,
        (queue, particles): (&Queue, usize),
        set: &ContactSet<T>,
        equation: impl Fn(usize) -> ContactEquation<T> + Sync,
    ) -> Result<()> {
        let (offsets, places) = set.rows();
        queue.synchronize()?;
        // Behind those of particles come those of nodes of bodies.
        let offsets = &offsets[..=particles];
        self.offsets.write(queue, offsets.len(), |out| out.copy_from_slice(offsets))?;
        self.places.write(queue, places.len(), |out| out.copy_from_slice(places))?;
        let data = |(contact, (out, state)): (usize, (&mut _, &ContactState<T>))| {
            let ContactEquation { particles, weights, carried } = equation(contact);
            let ContactAction { rows, force, .. } = state.action;
            *out = ContactData { particles, weights, rows, force, carried };
        };
        let count = set.states().len();
        self.counts = [count as u32, places.len() as u32];
        self.is_crowded = set.is_crowded();
        if self.is_crowded {
            self.ranks.grow(queue, 4 * count)?;
            self.terms.grow(queue, places.len())?;
        }
        self.contacts.write(queue, count, |out| {
            let all = out.par_iter_mut().zip(set.states()).enumerate();
            all.with_min_len(TASK).for_each(data);
        })
    }

    /// Where the contacts are.
    pub(crate) const fn table(&self) -> ContactTable {
        ContactTable {
            offsets: self.offsets.address(),
            places: self.places.address(),
            contacts: self.contacts.address(),
            ranks: self.ranks.address(),
            terms: if self.is_crowded { self.terms.address() } else { 0 },
            count: self.counts[0],
            place_count: self.counts[1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_copied_has_padding() {
        assert_eq!(size_of::<ContactData<f32>>(), 16 + 16 * 4);
        assert_eq!(size_of::<ContactData<f64>>(), 16 + 16 * 8);
    }
    /// The CUDA sources assert the same.
    #[test]
    fn kernels_are_given_as_many_bytes_as_they_take() {
        assert_eq!(size_of::<TrianglePairs<f32>>(), 4 * 4 + 10 * 4 + 8 * 8);
        assert_eq!(size_of::<TrianglePairs<f64>>(), 4 * 8 + 10 * 4 + 8 * 8);
    }
}
