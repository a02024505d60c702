//! The blocks of the matrix that triangles of fabric add, as `shared/linear.cuh` lays them out.

use cloth_core::{
    FabricMatrix, FabricTerms, Model, Neighbours, Result, SlicedRows, schwarz::ElementRows,
};

use super::data::LinearData;
use crate::{
    layout::{CudaReal, Real4},
    queue::{Buffer, Queue},
};

/// Numbers of what the blocks of a triangle are made of, and of a block.
const MEMBRANE: usize = 13;
const BLOCK: usize = 9;

/// Device memory of these blocks, whose pattern never changes.
pub(crate) struct ElementMemory<T> {
    rows: SlicedRows,
    membranes: Buffer<T>,
    stiffness: Buffer<T>,
    folds: Buffer<Real4<T>>,
    sums: Buffer<Real4<T>>,
    pattern: [Buffer<u32>; 2],
    terms: [Buffer<u32>; 2],
    blocks: Buffer<T>,
}

impl<T: CudaReal> ElementMemory<T> {
    /// Memory for the triangles of a model.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(queue: &Queue, model: &Model) -> Result<Self> {
        let neighbours = Neighbours::new(&model.interactions().of_fabric());
        let rows = SlicedRows::new(&neighbours);
        let elements = model.elements();
        let FabricTerms { offsets, terms } = FabricTerms::new(elements, &rows);
        let stiffness = elements.folds().iter().flat_map(|f| [f.stiffness, f.damping]);
        Ok(Self {
            membranes: Buffer::zeros(queue, MEMBRANE * elements.triangles().len())?,
            stiffness: Buffer::of(queue, &stiffness.map(T::from_f64).collect::<Vec<_>>())?,
            folds: Buffer::zeros(queue, 4 * elements.folds().len())?,
            terms: [Buffer::of(queue, &offsets)?, Buffer::of(queue, &terms)?],
            sums: Buffer::zeros(queue, 2 * model.particle_count())?,
            pattern: [Buffer::of(queue, &rows.slices)?, Buffer::of(queue, &rows.columns)?],
            blocks: Buffer::zeros(queue, BLOCK * rows.columns.len())?,
            rows,
        })
    }

    /// Places of blocks, those of no column among them.
    pub(crate) const fn place_count(&self) -> usize {
        self.rows.columns.len()
    }

    /// Tells kernels where it is.
    pub(crate) fn describe(&self, data: &mut LinearData<T>) {
        data.has_elements = 1;
        data.membrane_tangents = self.membranes.address();
        data.fold_stiffness = self.stiffness.address();
        data.fold_tangents = self.folds.address();
        [data.term_offsets, data.terms] = self.terms.each_ref().map(Buffer::address);
        data.element_sums = self.sums.address();
        [data.element_slices, data.element_columns] = self.pattern.each_ref().map(Buffer::address);
        data.element_blocks = self.blocks.address();
    }

    /// Writes the blocks of the constant matrix for substeps of `length` \[s\]: each a number times the unit matrix.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn constant_write(
        &mut self,
        queue: &Queue,
        fabric: &FabricMatrix,
        length: f64,
    ) -> Result<()> {
        const SLICE: usize = SlicedRows::SLICE;
        let weights: Vec<T> = fabric.sliced(&self.rows, |entry| entry.weight(length));
        let mut blocks = vec![T::ZERO; BLOCK * weights.len()];
        for (block, weights) in
            blocks.chunks_exact_mut(BLOCK * SLICE).zip(weights.chunks_exact(SLICE))
        {
            for place in [0, 4, 8] {
                block[place * SLICE..][..SLICE].copy_from_slice(weights);
            }
        }
        self.blocks.write(queue, 0, &blocks)?;
        let own = fabric.own().iter().map(|own| [T::from_f64(own.weight(length)); 4]);
        self.sums.write(queue, 0, &own.collect::<Vec<_>>())
    }

    /// The stiffness of the constant matrix, with the sign that springs have, in the places of its blocks.
    pub(crate) fn constant_stiffness(&self, fabric: &FabricMatrix) -> Vec<T> {
        fabric.sliced(&self.rows, |entry| -entry.stiffness)
    }

    /// What they are, for the host.
    ///
    /// # Errors
    /// `DeviceLost`.
    pub(crate) fn copy(&self, queue: &Queue) -> Result<ElementRows<T>> {
        let mut numbers = Vec::new();
        self.blocks.read(queue, &mut numbers)?;
        Ok(ElementRows { rows: self.rows.clone(), numbers })
    }
}
