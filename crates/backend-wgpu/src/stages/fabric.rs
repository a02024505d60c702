//! The stages of triangles of fabric: a kernel over triangles, whose results the gather of another one sums.

use cloth_core::{
    Neighbours, NewtonStart, Result, SlicedRows, schwarz::ElementRows, stepper::Substep,
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

    /// Forces of all triangles, added to f.
    pub(super) fn fabric_forces(
        &mut self,
        stage: &'static str,
        gather: &'static str,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.over_elements(stage, stage, 0)?;
        let items = (self.particle_count(), WORKGROUP);
        self.dispatch(stage, gather, items, self.present, (0, 0))
    }

    /// Tangents and impulses of all triangles.
    pub(super) fn fabric_linearise(
        &mut self,
        stage: &'static str,
        substep: &Substep,
        start: NewtonStart,
    ) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        self.linear_prepare()?;
        let slot = self.slot(substep)?;
        let flags = if start == NewtonStart::Iterate { CALL_ITERATE } else { 0 };
        let call = self.call(Call { flags, ..Call::default() })?;
        let items = (self.element_count(), WORKGROUP);
        self.dispatch(stage, stage, items, self.present, (slot, call))
    }

    /// What they add to the matrix and the right-hand side.
    pub(super) fn fabric_assemble(&mut self, slot: usize) -> Result<()> {
        let Some(rows) = &self.element_rows else { return Ok(()) };
        // For each row, whole slices of them, one thread more than the longest has blocks.
        let count = self.particle_count().next_multiple_of(SlicedRows::SLICE as u32);
        let items = (count * (rows.longest + 1), WORKGROUP);
        let name = "implicit_assemble_fabric";
        self.dispatch("implicit_assemble", name, items, self.present, (slot, 0))
    }

    /// Takes the memory of the blocks that triangles add to the matrix.
    pub(super) fn fabric_linear_prepare(&mut self) -> Result<()> {
        if self.element_count() == 0 {
            return Ok(());
        }
        let rows = SlicedRows::new(&Neighbours::new(&self.model.interactions().of_fabric()));
        let entries = entries(&rows);
        let contents: &[u8] = bytemuck::cast_slice(&entries);
        let particles = self.model.particle_count() as u64;
        for (name, size, contents) in [
            ("fabric_tangents", TANGENT_SIZE * u64::from(self.element_count()), None),
            ("element_sums", 3 * VECTOR_SIZE * particles, None),
            ("element_entries", contents.len() as u64, Some(contents)),
        ] {
            self.buffers.create(&self.context, name, size, contents)?;
        }
        self.element_rows = Some(rows);
        Ok(())
    }

    /// What triangles add to the matrix, for the host.
    pub(super) fn element_rows(&mut self) -> Result<Option<ElementRows<f32>>> {
        let Some(rows) = self.element_rows.clone() else { return Ok(None) };
        let (head, count) = (rows.slices.len(), rows.entry_count());
        let words = (head + count * ENTRY_WORDS) as u64;
        let entries: Vec<u32> = self.read_words("element_entries", words)?;
        let sums: Vec<[f32; 4]> =
            self.read_words("element_sums", 12 * self.model.particle_count() as u64)?;
        // The columns of an entry come before its numbers.
        let numbers = entries[head..].chunks_exact(ENTRY_WORDS);
        let numbers = numbers.flat_map(|entry| &entry[SlicedRows::SLICE..]);
        let diagonal = sums
            .as_chunks::<3>()
            .0
            .iter()
            .map(|[on, off, _]| [on[0], on[1], on[2], off[0], off[1], off[2]]);
        Ok(Some(ElementRows {
            numbers: numbers.map(|&word| f32::from_bits(word)).collect(),
            diagonal: diagonal.collect(),
            rows,
        }))
    }
}

/// Bytes of what the blocks of a triangle are made of (`shared/fabric_tangents.wgsl`).
const TANGENT_SIZE: u64 = 4 * 122;
/// Words of an entry of all rows of a slice: columns and blocks (`shared/element_row.wgsl`).
const ENTRY_WORDS: usize = 10 * SlicedRows::SLICE;

/// Contents of `element_entries`: where the entries of each slice begin, and the entries, without their blocks.
fn entries(rows: &SlicedRows) -> Vec<u32> {
    let head = rows.slices.len();
    let start = |&entry: &u32| head as u32 + entry * ENTRY_WORDS as u32;
    let mut words: Vec<u32> = rows.slices.iter().map(start).collect();
    words.resize(head + rows.entry_count() * ENTRY_WORDS, 0);
    let entries = words[head..].chunks_exact_mut(ENTRY_WORDS);
    for (entry, columns) in entries.zip(rows.columns.chunks_exact(SlicedRows::SLICE)) {
        entry[..SlicedRows::SLICE].copy_from_slice(columns);
    }
    words
}
