//! The matrix of a device, read back, as the preconditioner reads it.

use super::{Block, Coupling, Rows, rank_one, symmetric};
use crate::{MatrixBlock, Real, SlicedRows};

/// Pairs that springs or contact join, by rows: u and g of the blocks -(g I + u u^T).
#[derive(Clone, Debug, Default)]
pub struct PairRows<T> {
    /// Where the pairs of each particle start, and the end.
    pub starts: Vec<u32>,
    /// The other particle, u, and g.
    pub pairs: Vec<(u32, [T; 3], T)>,
}

impl<T: Copy> PairRows<T> {
    fn of(&self, particle: usize) -> &[(u32, [T; 3], T)] {
        match self.starts.get(particle..particle + 2) {
            Some(&[first, end]) => &self.pairs[first as usize..end as usize],
            _ => &[],
        }
    }
}

/// Blocks off the diagonal that triangles of fabric add.
#[derive(Clone, Debug)]
pub struct ElementRows<T> {
    /// The pattern.
    pub rows: SlicedRows,
    /// Nine numbers of each entry, row by row, [`SlicedRows::SLICE`] apart.
    pub numbers: Vec<T>,
}

impl<T: Real> ElementRows<T> {
    fn row(&self, particle: usize, mut visit: impl FnMut(u32, Block)) {
        let lane = particle % SlicedRows::SLICE;
        for (entry, other) in self.rows.row(particle) {
            let at = |k: usize| self.numbers[(9 * entry + k) * SlicedRows::SLICE + lane].to_f64();
            visit(other, [0, 3, 6].map(|row| [at(row), at(row + 1), at(row + 2)]));
        }
    }
}

/// A contact of triangles in the matrix, as [`ContactEquation`](crate::contact::ContactEquation) has it.
#[derive(Clone, Copy, Debug)]
pub struct ContactRow<T> {
    /// Its particles.
    pub particles: [u32; 4],
    /// Their weights, 0 for nodes of bodies.
    pub weights: [T; 4],
    /// S: xx, yy, zz, xy, xz, yz.
    pub rows: [T; 6],
}

impl<T: Real> ContactRow<T> {
    /// The blocks with the other particles in the row of one that has this weight.
    fn others(&self, particle: usize, weight: T, mut visit: impl FnMut(u32, Block)) {
        for (&other, &other_weight) in self.particles.iter().zip(&self.weights) {
            if other as usize != particle && other_weight != T::ZERO {
                let factor = weight * other_weight;
                visit(other, symmetric(self.rows.map(|entry| factor * entry)));
            }
        }
    }
}

/// Contacts of triangles by particle.
#[derive(Clone, Debug, Default)]
pub struct ContactRows<T> {
    /// All contacts.
    pub contacts: Vec<ContactRow<T>>,
    /// Where the places of each particle start, and the end.
    pub offsets: Vec<u32>,
    /// 4 c + a for place a of contact c.
    pub places: Vec<u32>,
}

impl<T: Real> ContactRows<T> {
    fn of(&self, particle: usize) -> impl Iterator<Item = (&ContactRow<T>, T)> {
        let places = match self.offsets.get(particle..particle + 2) {
            Some(&[first, end]) if !self.contacts.is_empty() => first as usize..end as usize,
            _ => 0..0,
        };
        self.places[places].iter().map(|&place| {
            let contact = &self.contacts[place as usize / 4];
            (contact, contact.weights[place as usize % 4])
        })
    }
}

/// A matrix of an implicit substep in the memory of the host, in the order and with the bits that a processor has of it.
#[derive(Clone, Debug)]
pub struct MatrixCopy<T> {
    /// Places \[m\].
    pub positions: Vec<[T; 3]>,
    /// B of each particle, without contacts: xx, yy, zz, xy, xz, yz.
    pub base: Vec<[T; 6]>,
    /// S of each particle, `None` for the identity.
    pub filters: Vec<Option<[T; 6]>>,
    /// Springs.
    pub springs: PairRows<T>,
    /// Pairs of points in contact, whose g is 0.
    pub pairs: PairRows<T>,
    /// Triangles of fabric.
    pub elements: Option<ElementRows<T>>,
    /// Contacts of triangles.
    pub contacts: ContactRows<T>,
}

impl<T: Real> Rows for MatrixCopy<T> {
    fn base(&self, particle: usize) -> Block {
        let mut base = symmetric(self.base[particle]);
        let mut of_bodies = [T::ZERO; 6];
        for (contact, weight) in self.contacts.of(particle) {
            // The sum of the weights: 0, or 1 or -1 where the other side is a body.
            let [a, b, c, d] = contact.weights.map(T::to_f64);
            let factor = weight * T::from_f64((a + b + c + d).round());
            (0..6).for_each(|entry| of_bodies[entry] += factor * contact.rows[entry]);
        }
        for (row, of_bodies) in base.iter_mut().zip(symmetric(of_bodies)) {
            row.iter_mut().zip(of_bodies).for_each(|(entry, of_bodies)| *entry += of_bodies);
        }
        base
    }

    fn filter(&self, particle: usize) -> Option<Block> {
        self.filters[particle].map(symmetric)
    }

    fn position(&self, particle: usize) -> [f64; 3] {
        self.positions[particle].map(T::to_f64)
    }

    fn row(&self, particle: usize, visit: &mut impl FnMut(usize, Block, Coupling)) {
        for &(other, u, g) in self.springs.of(particle) {
            visit(other as usize, rank_one(u, g), Coupling::Elastic);
        }
        if let Some(elements) = &self.elements {
            elements.row(particle, |other, block| {
                visit(other as usize, block, Coupling::Elastic);
            });
        }
        for &(other, u, _) in self.pairs.of(particle) {
            visit(other as usize, rank_one(u, T::ZERO), Coupling::Contact);
        }
        for (contact, weight) in self.contacts.of(particle) {
            contact.others(particle, weight, |other, block| {
                visit(other as usize, block, Coupling::Contact);
            });
        }
    }
}

impl<T: Real> MatrixCopy<T> {
    /// All blocks that can differ from zero, by rows, columns ascending, with these on the diagonal: xx, yy, zz, xy, xz, yz.
    pub fn read(&self, diagonal: &[[T; 6]], out: &mut Vec<MatrixBlock>) {
        out.clear();
        for (row, &own) in diagonal.iter().enumerate() {
            let start = out.len();
            let mut put = |column: u32, entries| {
                out.push(MatrixBlock { row: row as u32, column, entries });
            };
            put(row as u32, symmetric(own));
            for &(column, [x, y, z], g) in self.springs.of(row).iter().chain(self.pairs.of(row)) {
                let on = [-(g + x * x), -(g + y * y), -(g + z * z)];
                put(column, symmetric([on[0], on[1], on[2], -(x * y), -(x * z), -(y * z)]));
            }
            for (contact, weight) in self.contacts.of(row) {
                contact.others(row, weight, &mut put);
            }
            if let Some(elements) = &self.elements {
                elements.row(row, put);
            }
            out[start..].sort_by_key(|block| block.column);
        }
        out.dedup_by(|later, kept| {
            let same = (later.row, later.column) == (kept.row, kept.column);
            if same {
                let both = kept.entries.iter_mut().flatten().zip(later.entries.iter().flatten());
                both.for_each(|(kept, later)| *kept += later);
            }
            same
        });
    }
}
