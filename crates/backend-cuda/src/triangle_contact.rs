//! Memory of contact of triangles, as `shared/triangles.cuh` and `shared/contact_rows.cuh` lay it out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    Error, Result,
    contact::{
        ContactEquation, ContactSet,
        device::{DeviceContact, MOVED_NUMBERS, PAIR_WORDS, PAIRS_MAX, PairTask},
    },
};

use crate::{
    layout::{CudaReal, Real4},
    queue::{Buffer, Queue},
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
}

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
    /// Pairs that were found, and pairs in the list.
    pub(crate) counts: Buffer<u32>,
    pub(crate) found: Buffer<PairData>,
    pub(crate) moved: Buffer<T>,
    offsets: Buffer<u32>,
    places: Buffer<u32>,
    contacts: Buffer<ContactData<T>>,
}

/// An array for so many pairs.
fn pairs(queue: &Queue, count: u32) -> Result<Buffer<PairData>> {
    let overflow = || Error::Overflow {
        buffer: "pairs of triangles that may touch",
        needed: u64::from(count),
        capacity: u64::from(PAIRS_MAX),
    };
    if count > PAIRS_MAX {
        return Err(overflow());
    }
    Buffer::zeros(queue, count as usize)
}

impl<T: CudaReal> TriangleMemory<T> {
    /// Memory for the contact of `count` particles.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue, contact: &DeviceContact<T>, count: usize) -> Result<Self> {
        let task = &contact.list.task;
        let nodes = task.node_count as usize;
        Ok(Self {
            surface: Buffer::of(queue, &contact.surface_words())?,
            ways: Buffer::zeros(queue, 2 * nodes)?,
            references: Buffer::zeros(queue, 2 * nodes)?,
            boxes: Buffer::zeros(queue, contact.box_count())?,
            list: pairs(queue, task.pair_capacity)?,
            counts: Buffer::zeros(queue, 2)?,
            found: pairs(queue, task.found_capacity)?,
            moved: Buffer::zeros(queue, 2 * MOVED_NUMBERS * task.moved_blocks as usize)?,
            offsets: Buffer::zeros(queue, count + 1)?,
            places: Buffer::zeros(queue, 0)?,
            contacts: Buffer::zeros(queue, 0)?,
        })
    }

    /// What kernels are given.
    pub(crate) const fn data(&self, task: PairTask<T>) -> TrianglePairs<T> {
        TrianglePairs {
            task,
            surface: self.surface.address(),
            ways: self.ways.address(),
            references: self.references.address(),
            boxes: self.boxes.address(),
            list: self.list.address(),
            counts: self.counts.address(),
            found: self.found.address(),
            moved: self.moved.address(),
        }
    }

    /// Makes room for the list.
    ///
    /// # Errors
    /// `Overflow`, `OutOfMemory`.
    pub(crate) fn list_create(&mut self, queue: &Queue, count: u32) -> Result<()> {
        queue.synchronize()?;
        self.list = pairs(queue, count)?;
        Ok(())
    }

    /// Makes room for pairs that are found.
    ///
    /// # Errors
    /// `Overflow`, `OutOfMemory`.
    pub(crate) fn found_create(&mut self, queue: &Queue, count: u32) -> Result<()> {
        queue.synchronize()?;
        self.found = pairs(queue, count)?;
        Ok(())
    }

    /// Hands the contacts to the device.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn contacts_write(
        &mut self,
        queue: &Queue,
        set: &ContactSet<T>,
        equations: &[ContactEquation<T>],
    ) -> Result<()> {
        let (offsets, places) = set.rows();
        let all = equations.iter().zip(set.states());
        let contacts: Vec<_> = all
            .map(|(&ContactEquation { particles, weights, carried }, state)| ContactData {
                particles,
                weights,
                rows: state.action.rows,
                force: state.action.force,
                carried,
            })
            .collect();
        // Behind those of particles come those of nodes of bodies.
        self.offsets.write(queue, 0, &offsets[..self.offsets.len()])?;
        self.places.write_growing(queue, places)?;
        self.contacts.write_growing(queue, &contacts)
    }

    /// Where the contacts are.
    pub(crate) const fn table(&self) -> ContactTable {
        ContactTable {
            offsets: self.offsets.address(),
            places: self.places.address(),
            contacts: self.contacts.address(),
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
        assert_eq!(size_of::<TrianglePairs<f32>>(), 4 * 4 + 9 * 4 + 4 + 8 * 8);
        assert_eq!(size_of::<TrianglePairs<f64>>(), 4 * 8 + 9 * 4 + 4 + 8 * 8);
    }
}
