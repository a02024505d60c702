//! Matrix and vectors for tests and tools.

use cloth_core::{LinearVector, MatrixBlock, Result};

use super::Stages;
use crate::{
    buffers::VECTOR_SIZE, layout::Solve, linear::vector_number, tables::links::LinkTables,
    triangle_contact::blocks,
};

/// Entries of a symmetric 3 x 3 matrix: xx, yy, zz, xy, xz, yz.
type Symmetric = [f32; 6];

/// The other particle of a pair in contact, and u.
type ContactBlock = (usize, [f32; 3]);

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
        out.clear();
        self.linear_prepare()?;
        let count = self.model.particle_count();
        let links = LinkTables::new(&self.model);
        let diagonal: Vec<[f32; 4]> = self.read_words("matrix_diagonal", 8 * count as u64)?;
        let factors: Vec<[f32; 4]> = self.read_words("factors", 4 * links.places as u64)?;
        let pairs = self.contact_blocks()?;
        let elements = self.fabric_blocks()?;
        let triangles =
            self.triangles.as_ref().map_or_else(Vec::new, |all| blocks(&all.set, count));
        for (row, pairs) in pairs.iter().enumerate() {
            let [a, b] = [diagonal[2 * row], diagonal[2 * row + 1]];
            let start = out.len();
            out.push(dense(row, row, [a[0], a[1], a[2], b[0], b[1], b[2]]));
            for [column, place] in links.row(row) {
                let [x, y, z, e] = factors[place];
                out.push(dense(row, column, block([x, y, z], e.max(0.0))));
            }
            for &(column, u) in pairs {
                out.push(dense(row, column, block(u, 0.0)));
            }
            out.extend(elements.get(row).into_iter().flatten());
            out.extend(triangles.get(row).into_iter().flatten());
            out[start..].sort_by_key(|block| block.column);
            out.dedup_by(|later, kept| {
                let is_same = (later.row, later.column) == (kept.row, kept.column);
                if is_same {
                    let both =
                        kept.entries.iter_mut().flatten().zip(later.entries.iter().flatten());
                    both.for_each(|(kept, later)| *kept += later);
                }
                is_same
            });
        }
        Ok(())
    }

    /// The pairs in contact that are part of the matrix, by particle.
    fn contact_blocks(&mut self) -> Result<Vec<Vec<ContactBlock>>> {
        let count = self.model.particle_count();
        let mut blocks = vec![Vec::new(); count];
        if !self.is_penalty() {
            return Ok(blocks);
        }
        let rows: Vec<[u32; 2]> = self.read_words("contact_rows", 2 * count as u64)?;
        let used = rows.iter().map(|row| u64::from(row[0] + row[1])).max().unwrap_or(0);
        let entries: Vec<u32> = self.read_words("contact_entries", used)?;
        let factors: Vec<[f32; 4]> = self.read_words("contact_factors", 4 * used)?;
        for (blocks, [first, length]) in blocks.iter_mut().zip(rows) {
            for at in first as usize..(first + length) as usize {
                let [x, y, z, is_touching] = factors[at];
                if is_touching != 0.0 {
                    blocks.push((entries[at] as usize, [x, y, z]));
                }
            }
        }
        Ok(blocks)
    }
}

/// -(g I + u u^T).
fn block([x, y, z]: [f32; 3], g: f32) -> Symmetric {
    [-(g + x * x), -(g + y * y), -(g + z * z), -(x * y), -(x * z), -(y * z)]
}

fn dense(row: usize, column: usize, block: Symmetric) -> MatrixBlock {
    let [xx, yy, zz, xy, xz, yz] = block.map(f64::from);
    MatrixBlock {
        row: row as u32,
        column: column as u32,
        entries: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
    }
}
