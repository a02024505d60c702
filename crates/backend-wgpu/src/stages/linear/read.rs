//! Matrix and vectors for tests and tools.

use cloth_core::{
    LinearVector, MatrixBlock, Result,
    schwarz::{MatrixCopy, PairRows},
};

use super::{Stages, memory::CONSTRAINT_SIZE};
use crate::{
    buffers::VECTOR_SIZE, layout::Solve, linear::vector_number, tables::links::LinkTables,
};

/// Entries of a symmetric 3 x 3 matrix: xx, yy, zz, xy, xz, yz.
type Symmetric = [f32; 6];

impl Stages {
    pub(crate) fn vector_read(
        &mut self,
        vector: LinearVector,
        out: &mut Vec<[f64; 3]>,
    ) -> Result<()> {
        self.linear_prepare()?;
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        let offset = u64::from(vector_number(vector)) * size;
        let buffer = self.buffers.get("vectors", 0, 0)?.clone();
        self.read_part(&buffer, offset, size, |bytes| {
            super::super::motion::collect(out, bytes);
        })
    }

    pub(crate) fn vector_write(&mut self, vector: LinearVector, values: &[[f64; 3]]) -> Result<()> {
        self.linear_prepare()?;
        let size = VECTOR_SIZE * self.model.particle_count() as u64;
        let numbers: Vec<[f32; 4]> =
            values.iter().map(|&[x, y, z]| [x as f32, y as f32, z as f32, 0.0]).collect();
        let offset = u64::from(vector_number(vector)) * size;
        self.write("vectors", offset, bytemuck::cast_slice(&numbers))
    }

    pub(super) fn solve_read(&mut self) -> Result<Solve> {
        let buffer = self.buffers.get("solve", 0, 0)?.clone();
        let mut solve = Solve::default();
        self.read_part(&buffer, 0, size_of::<Solve>() as u64, |bytes| {
            solve = bytemuck::pod_read_unaligned(bytes);
        })?;
        Ok(solve)
    }

    pub(in crate::stages) fn solve_write(&mut self, offset: usize, words: &[u32]) -> Result<()> {
        self.write("solve", offset as u64, bytemuck::cast_slice(words))
    }

    pub(crate) fn matrix_read(&mut self, out: &mut Vec<MatrixBlock>) -> Result<()> {
        self.linear_prepare()?;
        let words = 8 * self.model.particle_count() as u64;
        let diagonal: Vec<[f32; 4]> = self.read_words("matrix_diagonal", words)?;
        let diagonal: Vec<_> = diagonal.as_chunks::<2>().0.iter().map(symmetric).collect();
        self.matrix_copy()?.read(&diagonal, out);
        Ok(())
    }

    /// The matrix in the memory of the host.
    pub(super) fn matrix_copy(&mut self) -> Result<MatrixCopy<f32>> {
        self.linear_prepare()?;
        let count = self.model.particle_count();
        let base: Vec<[f32; 4]> = self.read_words("matrix_base", 8 * count as u64)?;
        let positions = self.buffers.position(self.present).clone();
        let mut position = Vec::new();
        self.vectors_read(&positions, &mut position)?;
        Ok(MatrixCopy {
            positions: position.iter().map(|&[x, y, z, _]| [x, y, z]).collect(),
            base: base.as_chunks::<2>().0.iter().map(symmetric).collect(),
            filters: self.filters_read()?,
            springs: self.spring_pairs()?,
            pairs: self.touching_pairs()?,
            elements: self.element_rows()?,
            contacts: self.triangles.as_ref().map(|all| all.rows()).unwrap_or_default(),
        })
    }

    /// S of all particles, `None` for the identity.
    pub(super) fn filters_read(&mut self) -> Result<Vec<Option<Symmetric>>> {
        let count = self.model.particle_count();
        let positions = self.buffers.position(self.present).clone();
        let mut position = Vec::new();
        self.vectors_read(&positions, &mut position)?;
        let constraints: Vec<u32> = match self.buffers.has("constraints") {
            true => self.read_words("constraints", CONSTRAINT_WORDS as u64 * count as u64)?,
            false => Vec::new(),
        };
        let mut filters: Vec<_> = position
            .iter()
            .map(|position| (position[3] <= 0.0).then_some(Symmetric::default()))
            .collect();
        for (filter, words) in filters.iter_mut().zip(constraints.chunks_exact(CONSTRAINT_WORDS)) {
            // The number of contacts stands between both halves of S.
            if filter.is_none() && words[3] > 0 {
                *filter = Some([0, 1, 2, 4, 5, 6].map(|word| f32::from_bits(words[word])));
            }
        }
        Ok(filters)
    }

    fn spring_pairs(&mut self) -> Result<PairRows<f32>> {
        if self.model.springs().is_empty() {
            return Ok(PairRows::default());
        }
        let links = LinkTables::new(&self.model);
        let factors: Vec<[f32; 4]> = self.read_words("factors", 4 * links.places as u64)?;
        let mut springs = PairRows { starts: vec![0], pairs: Vec::new() };
        for row in 0..self.model.particle_count() {
            springs.pairs.extend(links.row(row).map(|[column, place]| {
                let [x, y, z, e] = factors[place];
                (column as u32, [x, y, z], e.max(0.0))
            }));
            springs.starts.push(springs.pairs.len() as u32);
        }
        Ok(springs)
    }

    /// The pairs in contact that are part of the matrix.
    fn touching_pairs(&mut self) -> Result<PairRows<f32>> {
        if !self.is_penalty() {
            return Ok(PairRows::default());
        }
        let count = self.model.particle_count();
        let rows: Vec<[u32; 2]> = self.read_words("contact_rows", 2 * count as u64)?;
        let used = rows.iter().map(|row| u64::from(row[0] + row[1])).max().unwrap_or(0);
        let entries: Vec<u32> = self.read_words("contact_entries", used)?;
        let factors: Vec<[f32; 4]> = self.read_words("contact_factors", 4 * used)?;
        let mut pairs = PairRows { starts: vec![0], pairs: Vec::new() };
        for [first, length] in rows {
            for at in first as usize..(first + length) as usize {
                let [x, y, z, is_touching] = factors[at];
                if is_touching != 0.0 {
                    pairs.pairs.push((entries[at], [x, y, z], 0.0));
                }
            }
            pairs.starts.push(pairs.pairs.len() as u32);
        }
        Ok(pairs)
    }
}

/// Words of the constraint of a particle (`shared/constraint.wgsl`).
const CONSTRAINT_WORDS: usize = CONSTRAINT_SIZE as usize / 4;

/// A matrix that is kept as two vectors.
const fn symmetric([on, off]: &[[f32; 4]; 2]) -> Symmetric {
    [on[0], on[1], on[2], off[0], off[1], off[2]]
}
