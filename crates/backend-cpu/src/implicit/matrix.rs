//! The matrix of the linear system and its right-hand side.

use cloth_core::{MatrixBlock, Model, Real};

use super::{
    contact_linearise::ContactFactors,
    contact_rows::ContactRows,
    direct::FullBlock,
    particle_filters::rows,
    spring_factors::{Factors, SpringFactors, across},
};
use crate::{
    fabric::ElementBlocks,
    memory::{LANES, VectorField},
    springs::{Neighbours, SpringColumns},
};

/// A symmetric 3 x 3 matrix for each particle: diagonal and off-diagonal (xy, xz, yz).
#[derive(Debug)]
pub(crate) struct BlockField<T> {
    pub(super) diagonal: VectorField<T>,
    /// Absent where it is zero.
    pub(super) off_diagonal: Option<VectorField<T>>,
}

/// Six numbers of a symmetric 3 x 3 matrix: xx, yy, zz, xy, xz, yz.
pub(super) type Symmetric<T> = [T; 6];

impl<T: Real> BlockField<T> {
    pub(super) fn new(count: usize, full: bool) -> Self {
        let field = || VectorField::new(count, 0);
        Self { diagonal: field(), off_diagonal: full.then(field) }
    }

    pub(super) fn get(&self, particle: usize) -> Symmetric<T> {
        let [xx, yy, zz] = self.diagonal.get(particle);
        let [xy, xz, yz] =
            self.off_diagonal.as_ref().map_or([T::ZERO; 3], |field| field.get(particle));
        [xx, yy, zz, xy, xz, yz]
    }

    /// Adds to one block. Without memory off the diagonal, only that is added.
    pub(super) fn add(&mut self, particle: usize, change: Symmetric<T>) {
        let block = self.get(particle);
        self.set(particle, std::array::from_fn(|entry| block[entry] + change[entry]));
    }

    pub(super) fn set(&mut self, particle: usize, [xx, yy, zz, xy, xz, yz]: Symmetric<T>) {
        self.diagonal.set(particle, [xx, yy, zz]);
        if let Some(field) = &mut self.off_diagonal {
            field.set(particle, [xy, xz, yz]);
        }
    }
}

/// What A is made of.
#[derive(Debug)]
pub(crate) struct Matrix<T> {
    pub(super) factors: SpringFactors<T>,
    pub(super) contacts: ContactFactors<T>,
    /// Contacts of triangles.
    pub(super) rows: ContactRows<T>,
    /// B of NUMERICS §5: mass, drag, air, friction.
    pub(super) base: BlockField<T>,
    /// D of NUMERICS §5: the diagonal blocks of A.
    pub(super) diagonal: BlockField<T>,
    /// What triangles of fabric add off the diagonal.
    pub(super) elements: Option<ElementBlocks<T>>,
}

impl<T: Real> Matrix<T> {
    pub(super) fn new(springs: &SpringColumns<T>, model: &Model) -> Self {
        let count = model.particle_count();
        let full = model.air().is_some() || !model.colliders().is_empty() || model.has_fabric();
        Self {
            elements: model.has_fabric().then(|| ElementBlocks::new(model)),
            factors: SpringFactors::new(springs, count),
            contacts: ContactFactors::new(),
            rows: ContactRows::new(count),
            base: BlockField::new(count, full),
            diagonal: BlockField::new(count, true),
        }
    }

    /// Every block off the diagonal of the row of `particle`, springs first, then contacts, columns
    /// ascending in each.
    pub(super) fn row(
        &self,
        springs: &SpringColumns<T>,
        particle: usize,
        mut visit: impl FnMut(usize, Symmetric<T>),
    ) {
        self.row_factors(springs, particle, |neighbour, u, g| visit(neighbour, block(u, g)));
        for pair in self.contacts.of(particle) {
            visit(pair.partner, block(pair.u, T::ZERO));
        }
        self.rows.row(particle, visit);
    }

    /// u and g of every spring of `particle`, columns ascending.
    pub(super) fn row_factors(
        &self,
        springs: &SpringColumns<T>,
        particle: usize,
        mut visit: impl FnMut(usize, [T; 3], T),
    ) {
        let (packet, lane) = (particle / LANES, particle % LANES);
        let position = &self.factors.position;
        let columns = springs.packet(packet).iter();
        for (column, Factors { root, along }) in columns.zip(self.factors.packet(packet)) {
            if column.active[lane] == T::ZERO {
                continue;
            }
            let neighbour = match &column.neighbours {
                Neighbours::Offset(offset) => particle.wrapping_add_signed(*offset as isize),
                Neighbours::Indices(indices) => indices[lane] as usize,
            };
            let (own, other) = (position.get(particle), position.get(neighbour));
            let u = std::array::from_fn(|axis| root[lane] * (other[axis] - own[axis]));
            visit(neighbour, u, across(along[lane], u));
        }
    }

    /// Blocks right of the diagonal that triangles add, in fabric and in contact; a column may come more than once.
    pub(super) fn full_blocks(&self, count: usize) -> Vec<FullBlock<T>> {
        let mut all = Vec::new();
        for i in 0..count {
            let mut put = |j: usize, block: [[T; 3]; 3]| {
                if j > i {
                    all.push((i as u32, j as u32, block));
                }
            };
            if let Some(elements) = &self.elements {
                elements.row(i, &mut put);
            }
            self.rows.row(i, |j, block| put(j, rows(&block)));
        }
        all
    }

    /// All blocks, by rows, columns ascending; a pair that a spring and contact join has one.
    pub(super) fn read(
        &self,
        springs: &SpringColumns<T>,
        count: usize,
        out: &mut Vec<MatrixBlock>,
    ) {
        out.clear();
        for row in 0..count {
            let start = out.len();
            out.push(dense(row, row, self.diagonal.get(row)));
            self.row(springs, row, |column, block| out.push(dense(row, column, block)));
            if let Some(elements) = &self.elements {
                elements.row(row, |column, block| {
                    let entries = block.map(|row| row.map(T::to_f64));
                    out.push(MatrixBlock { row: row as u32, column: column as u32, entries });
                });
            }
            out[start..].sort_by_key(|block| block.column);
            out.dedup_by(|later, kept| {
                let same = (later.row, later.column) == (kept.row, kept.column);
                if same {
                    for (kept, later) in kept.entries.iter_mut().zip(later.entries) {
                        kept.iter_mut().zip(later).for_each(|(kept, later)| *kept += later);
                    }
                }
                same
            });
        }
    }
}

/// -(g I + u u^T).
fn block<T: Real>([x, y, z]: [T; 3], g: T) -> Symmetric<T> {
    [-(g + x * x), -(g + y * y), -(g + z * z), -(x * y), -(x * z), -(y * z)]
}

fn dense<T: Real>(row: usize, column: usize, block: Symmetric<T>) -> MatrixBlock {
    let [xx, yy, zz, xy, xz, yz] = block.map(T::to_f64);
    MatrixBlock {
        row: row as u32,
        column: column as u32,
        entries: [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]],
    }
}
