//! The matrix of the linear system in the memory of the host.

use cloth_core::{
    Result,
    schwarz::{MatrixCopy, PairRows},
};

use super::CudaKernels;
use crate::{
    layout::{CudaReal, Real4},
    linear::LinearMemory,
    memory::Memory,
};

/// Shape of the header of a row of springs: how many, and from which bit on the logarithm of their stride.
const ROW_COUNT: u32 = 0xff_ffff;
const ROW_STRIDE: u32 = 24;
/// Bit of the number of a spring that lies behind all slots.
const OWN: u32 = 1 << 31;

/// xx, yy, zz, xy, xz, yz of a matrix that is kept as two vectors.
pub(super) fn symmetric<T: CudaReal>(on: &Real4<T>, off: &Real4<T>) -> [T; 6] {
    [on[0], on[1], on[2], off[0], off[1], off[2]]
}

impl<T: CudaReal> CudaKernels<T> {
    /// The matrix, if there ever was one.
    pub(super) fn matrix_copy(&mut self) -> Result<Option<MatrixCopy<T>>> {
        self.settle()?;
        let filters = self.filters_read()?;
        let Some(linear) = &self.linear else { return Ok(None) };
        let (memory, queue) = (&self.memory, &self.memory.queue);
        let present = memory.present();
        let mut positions = Vec::new();
        memory.state.position[present].read(queue, &mut positions)?;
        let (mut on, mut off) = (Vec::new(), Vec::new());
        linear.base[0].read(queue, &mut on)?;
        if linear.data.is_full != 0 {
            linear.base[1].read(queue, &mut off)?;
        } else {
            off.resize(on.len(), [T::ZERO; 4]);
        }
        let elements = linear.elements.as_ref().map(|all| all.copy(queue)).transpose()?;
        let touching = self.triangles.as_ref().filter(|_| linear.data.has_contacts != 0);
        Ok(Some(MatrixCopy {
            positions: positions.iter().map(|&[x, y, z, _]| [x, y, z]).collect(),
            base: on.iter().zip(&off).map(|(on, off)| symmetric(on, off)).collect(),
            filters,
            springs: springs_copy(memory, linear)?,
            pairs: pairs_copy(memory, linear)?,
            elements,
            contacts: touching.map(|triangles| triangles.rows()).unwrap_or_default(),
        }))
    }

    /// S of all particles, `None` for the identity.
    pub(super) fn filters_read(&mut self) -> Result<Vec<Option<[T; 6]>>> {
        let Some(linear) = &self.linear else { return Ok(Vec::new()) };
        let (memory, queue) = (&self.memory, &self.memory.queue);
        let mut positions = Vec::new();
        memory.state.position[memory.present()].read(queue, &mut positions)?;
        let (mut counts, mut on, mut off) = (Vec::new(), Vec::new(), Vec::new());
        if linear.data.has_constraints != 0 {
            linear.touch_counts.read(queue, &mut counts)?;
            linear.filter[0].read(queue, &mut on)?;
            linear.filter[1].read(queue, &mut off)?;
        }
        let filter = |(i, position): (usize, &Real4<T>)| {
            let touches = counts.get(i).is_some_and(|&count| count > 0);
            match position[3] > T::ZERO {
                false => Some([T::ZERO; 6]),
                true => touches.then(|| symmetric(&on[i], &off[i])),
            }
        };
        Ok(positions.iter().enumerate().map(filter).collect())
    }
}

fn springs_copy<T: CudaReal>(memory: &Memory<T>, linear: &LinearMemory<T>) -> Result<PairRows<T>> {
    let tables = &memory.tables.springs;
    if tables.entries.is_empty() {
        return Ok(PairRows::default());
    }
    let queue = &memory.queue;
    let (mut factors, mut shared, mut origin) = (Vec::new(), Vec::new(), Vec::new());
    linear.factors.read(queue, &mut factors)?;
    if let Some(along) = &linear.along {
        along.read(queue, &mut shared)?;
    }
    linear.origin.read(queue, &mut origin)?;
    let n = memory.data.count as usize;
    let mut copy = PairRows { starts: vec![0], pairs: Vec::new() };
    for i in 0..n {
        let [first, shape] = tables.headers[tables.rows[i] as usize];
        for k in 0..shape & ROW_COUNT {
            let at = (first + (k << (shape >> ROW_STRIDE))) as usize;
            let j = (i as u32).wrapping_add(tables.entries[at][0]) as usize;
            let slot = tables.slots[at];
            let place = match slot & OWN {
                0 => slot as usize * n + i.min(j),
                _ => tables.slot_count as usize * n + (slot & !OWN) as usize,
            };
            let root = factors[if shared.is_empty() { 2 * place } else { place }];
            let u: [T; 3] = [0, 1, 2].map(|axis| root * (origin[j][axis] - origin[i][axis]));
            let g = match shared.get(at) {
                Some(&along) => {
                    (along - (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])).maximum(T::ZERO)
                }
                None => factors[2 * place + 1],
            };
            copy.pairs.push((j as u32, u, g));
        }
        copy.starts.push(copy.pairs.len() as u32);
    }
    Ok(copy)
}

/// Pairs of points in contact, if they are part of the matrix.
pub(super) fn pairs_copy<T: CudaReal>(
    memory: &Memory<T>,
    linear: &LinearMemory<T>,
) -> Result<PairRows<T>> {
    let Some(pairs) = linear.pairs.as_ref().filter(|_| linear.data.has_pairs != 0) else {
        return Ok(PairRows::default());
    };
    let (mut partners, mut factors, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    pairs.partners.read(&memory.queue, &mut partners)?;
    pairs.factors.read(&memory.queue, &mut factors)?;
    pairs.counts.read(&memory.queue, &mut counts)?;
    let n = memory.data.count as usize;
    let mut copy = PairRows { starts: vec![0], pairs: Vec::new() };
    for (i, &count) in counts.iter().enumerate() {
        for k in 0..count as usize {
            let [x, y, z, g]: Real4<T> = factors[k * n + i];
            copy.pairs.push((partners[k * n + i], [x, y, z], g));
        }
        copy.starts.push(copy.pairs.len() as u32);
    }
    Ok(copy)
}
