//! The stages of triangles of fabric: a kernel over triangles, whose results the gather of another one sums.

use cloth_core::{
    FabricElements, FabricMatrix, FabricTerms, Neighbours, NewtonStart, Result, SlicedRows,
    schwarz::ElementRows, stepper::Substep,
};

use super::Stages;
use crate::{
    buffers::VECTOR_SIZE,
    dispatch::WORKGROUP,
    layout::{CALL_ITERATE, Call},
};

impl Stages {
    /// A kernel with one thread for each triangle of fabric.
    pub(super) fn over_elements(
        &mut self,
        stage: &'static str,
        name: &'static str,
        slot: usize,
    ) -> Result<()> {
        let items = (self.element_count(), WORKGROUP);
        self.dispatch(stage, name, items, self.present, (slot, 0))
    }

    /// A kernel with one thread for each fold.
    pub(super) fn over_folds(
        &mut self,
        stage: &'static str,
        name: &'static str,
        slot: usize,
    ) -> Result<()> {
        if self.fold_count() == 0 {
            return Ok(());
        }
        let items = (self.fold_count(), WORKGROUP);
        self.dispatch(stage, name, items, self.present, (slot, 0))
    }

    /// Forces of stretched triangles, added to f.
    pub(super) fn membrane_forces(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let stage = "membrane_forces";
        self.over_elements(stage, stage, 0)?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(stage, "membrane_forces_gather", items, self.present, (0, 0))
    }

    /// Forces of folds, added to f.
    pub(super) fn bending_forces(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let stage = "bending_forces";
        self.over_folds(stage, "bending_forces_folds", 0)?;
        self.over_elements(stage, "bending_forces_moments", 0)?;
        self.over_folds(stage, stage, 0)?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(stage, "bending_forces_gather", items, self.present, (0, 0))
    }

    /// The slot and the call of a stage that linearises triangles.
    fn linearise_at(&mut self, substep: &Substep, start: NewtonStart) -> Result<(usize, usize)> {
        self.linear_prepare()?;
        let slot = self.slot(substep)?;
        let flags = if start == NewtonStart::Iterate { CALL_ITERATE } else { 0 };
        Ok((slot, self.call(Call { flags, ..Call::default() })?))
    }

    /// `membrane_linearise`.
    pub(super) fn membrane_linearise(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let at = self.linearise_at(substep, start)?;
        let items = (self.element_count(), WORKGROUP);
        let stage = "membrane_linearise";
        self.dispatch(stage, stage, items, self.present, at)
    }

    /// `bending_linearise`.
    pub(super) fn bending_linearise(
        &mut self,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let at = self.linearise_at(substep, start)?;
        let (elements, stage) = (self.element_count(), "bending_linearise");
        self.over_folds(stage, "bending_forces_folds", 0)?;
        let moments = "bending_linearise_moments";
        self.dispatch(stage, moments, (elements, WORKGROUP), self.present, at)?;
        self.over_folds(stage, "bending_forces", 0)?;
        self.over_folds(stage, stage, at.0)
    }

    /// What they add to the matrix and the right-hand side.
    pub(super) fn fabric_assemble(&mut self, slot: usize) -> Result<()> {
        let Some(rows) = &self.element_rows else { return Ok(()) };
        let (places, stage) = (rows.columns.len() as u32, "implicit_assemble");
        let blocks = "implicit_assemble_fabric";
        self.dispatch(stage, blocks, (places, WORKGROUP), self.present, (slot, 0))?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(stage, "implicit_assemble_fabric_rows", items, self.present, (slot, 0))
    }

    /// Takes the memory of the blocks that triangles add to the matrix.
    pub(super) fn fabric_linear_prepare(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let rows = SlicedRows::new(&Neighbours::new(&self.model.interactions().of_fabric()));
        let entries = entries(&rows, ENTRY_WORDS);
        let contents: &[u8] = bytemuck::cast_slice(&entries);
        let terms = terms(self.model.elements(), &rows);
        let terms: &[u8] = bytemuck::cast_slice(&terms);
        let particles = self.model.particle_count() as u64;
        let tangents = u64::from(self.element_count()) + u64::from(self.fold_count());
        for (name, size, contents) in [
            ("fabric_tangents", 4 * VECTOR_SIZE * tangents, None),
            ("fabric_terms", terms.len() as u64, Some(terms)),
            ("element_sums", 3 * VECTOR_SIZE * particles, None),
            ("element_entries", contents.len() as u64, Some(contents)),
        ] {
            self.buffers.create(&self.context, name, size, contents)?;
        }
        self.element_rows = Some(rows);
        Ok(())
    }

    /// Writes what triangles add to the constant matrix of substeps of `length` \[s\].
    pub(super) fn fabric_constant_write(
        &mut self,
        fabric: &FabricMatrix,
        length: f64,
    ) -> Result<()> {
        self.linear_prepare()?;
        let Some(rows) = &self.element_rows else { return Ok(()) };
        let mut words = entries(rows, ENTRY_WORDS);
        let weights: Vec<f32> = fabric.sliced(rows, |entry| entry.weight(length));
        numbers_fill(&mut words[rows.slices.len()..], ENTRY_WORDS, &[1, 5, 9], &weights);
        let own = fabric.own().iter().map(|own| own.weight(length) as f32);
        let sums: Vec<[[f32; 4]; 3]> =
            own.map(|own| [[own, own, own, 0.0], [0.0; 4], [0.0; 4]]).collect();
        self.write("element_entries", 0, bytemuck::cast_slice(&words))?;
        self.write("element_sums", 0, bytemuck::cast_slice(&sums))
    }

    /// Puts its stiffness on the device, with the sign that springs have.
    pub(super) fn fabric_constant_prepare(&mut self, fabric: &FabricMatrix) -> Result<()> {
        self.linear_prepare()?;
        let Some(rows) = &self.element_rows else { return Ok(()) };
        let mut words = entries(rows, CONSTANT_WORDS);
        let stiffness: Vec<f32> = fabric.sliced(rows, |entry| -entry.stiffness);
        numbers_fill(&mut words[rows.slices.len()..], CONSTANT_WORDS, &[1], &stiffness);
        let contents: &[u8] = bytemuck::cast_slice(&words);
        let size = contents.len() as u64;
        self.buffers.create(&self.context, "constant_entries", size, Some(contents))
    }

    /// What triangles add to the matrix, for the host.
    pub(super) fn element_rows(&mut self) -> Result<Option<ElementRows<f32>>> {
        let Some(rows) = self.element_rows.clone() else { return Ok(None) };
        let (head, count) = (rows.slices.len(), rows.entry_count());
        let buffer = self.buffers.get("element_entries", 0, 0)?.clone();
        let size = 4 * (count * ENTRY_WORDS) as u64;
        let mut numbers = Vec::with_capacity(count * (ENTRY_WORDS - SlicedRows::SLICE));
        if size > 0 {
            // The columns of an entry come before its numbers.
            self.read_part(&buffer, 4 * head as u64, size, |bytes| {
                for entry in bytes.chunks_exact(4 * ENTRY_WORDS) {
                    let own = &entry[4 * SlicedRows::SLICE..];
                    numbers.extend_from_slice(bytemuck::cast_slice::<_, f32>(own));
                }
            })?;
        }
        Ok(Some(ElementRows { rows, numbers }))
    }
}

/// Words of an entry of all rows of a slice: columns and blocks (`shared/element_row.wgsl`).
const ENTRY_WORDS: usize = 10 * SlicedRows::SLICE;

/// Words of an entry with one number in place of a block (`shared/element_pull.wgsl`).
const CONSTANT_WORDS: usize = 2 * SlicedRows::SLICE;

/// Contents of `element_entries` and `constant_entries`: where the entries of each slice begin, and the entries, of so many words, without
/// their numbers.
fn entries(rows: &SlicedRows, entry_words: usize) -> Vec<u32> {
    let head = rows.slices.len();
    let start = |&entry: &u32| head as u32 + entry * entry_words as u32;
    let mut words: Vec<u32> = rows.slices.iter().map(start).collect();
    words.resize(head + rows.entry_count() * entry_words, 0);
    let entries = words[head..].chunks_exact_mut(entry_words);
    for (entry, columns) in entries.zip(rows.columns.chunks_exact(SlicedRows::SLICE)) {
        entry[..SlicedRows::SLICE].copy_from_slice(columns);
    }
    words
}

/// Contents of `fabric_terms`: where the terms of each place begin, and the terms.
fn terms(elements: &FabricElements, rows: &SlicedRows) -> Vec<u32> {
    let FabricTerms { offsets, terms } = FabricTerms::new(elements, rows);
    let first = offsets.len() as u32;
    offsets.into_iter().map(|offset| first + offset).chain(terms).collect()
}

/// Puts the numbers of all entries at some places of these, each as wide as a slice.
fn numbers_fill(entries: &mut [u32], entry_words: usize, places: &[usize], numbers: &[f32]) {
    let numbers = numbers.chunks_exact(SlicedRows::SLICE);
    for (entry, numbers) in entries.chunks_exact_mut(entry_words).zip(numbers) {
        for place in places {
            let words = &mut entry[place * SlicedRows::SLICE..][..SlicedRows::SLICE];
            words.iter_mut().zip(numbers).for_each(|(word, number)| *word = number.to_bits());
        }
    }
}
