//! What is kept of each spring for the matrix, and what follows from it.
//!
//! A spring contributes g I + u u^T, NUMERICS §5. Of each spring one number is kept, `root`: u is `root` times the
//! difference of the positions of its ends, and g is what u leaves of the stiffness along the spring. That is shared
//! by all springs of a kind, unless they buckle. So u and g are computed again wherever they are needed, always
//! with the same bits, in less time than it takes to read more numbers from memory.
//!
//! Every particle has the roots of all its springs, in the order in which rows are summed up: packet by packet,
//! column by column, and where packets are worked on together column by column and then packet by packet. So they
//! are one stream of memory that is read from start to end.

use cloth_core::Real;
use rayon::prelude::*;

use crate::{
    memory::{LANES, Lanes, VectorField},
    springs::{Neighbours, SpringColumns},
};

/// Packets that are worked on together: enough to hide what it takes to find the numbers of a term, few enough
/// that all that is used again stays in registers.
pub(super) const GROUP: usize = 2;

/// A group whose packets do not have the same offsets.
const NONE: u32 = u32::MAX;

/// One number for a spring in each lane. Whole lines of the cache, so that loads touch one each.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Entry<T>(pub(super) Lanes<T>);

/// The springs of a column: `root`, and h^2 T' + h c \[kg\], the stiffness along them; both zero in a lane without
/// one.
#[derive(Clone, Copy)]
pub(super) struct Factors<'a, T> {
    pub(super) root: &'a Lanes<T>,
    pub(super) along: &'a Lanes<T>,
}

/// g of a spring from the stiffness along it and its u.
#[inline(always)]
pub(super) fn across<T: Real>(along: T, [x, y, z]: [T; 3]) -> T {
    (along - (x * x + y * y + z * z)).maximum(T::ZERO)
}

/// The factors of all springs.
#[derive(Debug)]
pub(super) struct SpringFactors<T> {
    roots: Vec<Entry<T>>,
    /// Stiffness along springs: of all columns, which packets share, then of the packets where springs buckle.
    along: Vec<Entry<T>>,
    column_count: usize,
    /// The positions that they were computed at.
    pub(super) position: VectorField<T>,
    rows: Vec<Row>,
    /// For each group, its place in `offsets`, or [`NONE`].
    groups: Vec<u32>,
    /// Offsets from particles to their neighbours, column by column.
    offsets: Vec<Vec<i32>>,
}

/// Where the factors of a packet are.
#[derive(Clone, Copy, Debug)]
struct Row {
    root: u32,
    /// From one root to the next.
    stride: u32,
    along: u32,
    columns: u32,
    buckles: bool,
}

/// Packets that have the same offsets.
pub(super) struct Group<'a, T> {
    pub(super) offsets: &'a [i32],
    /// Column by column, and in each packet by packet.
    pub(super) roots: &'a [[Entry<T>; GROUP]],
    /// Packet by packet.
    pub(super) along: [&'a [Entry<T>]; GROUP],
}

impl<T: Real> SpringFactors<T> {
    pub(super) fn new(springs: &SpringColumns<T>, count: usize) -> Self {
        let column_count = springs.columns().len();
        let mut factors = Self {
            roots: Vec::new(),
            along: Vec::new(),
            column_count,
            position: VectorField::new(count, springs.margin()),
            rows: Vec::new(),
            groups: Vec::new(),
            offsets: Vec::new(),
        };
        let mut end = 0;
        let mut along_end = column_count as u32;
        let packets: Vec<usize> = (0..springs.packet_count()).collect();
        for group in packets.chunks(GROUP) {
            let offsets = offsets_of_all(springs, group);
            let stride = if offsets.is_some() { GROUP as u32 } else { 1 };
            for (number, &packet) in group.iter().enumerate() {
                let own = springs.packet(packet);
                let columns = own.len() as u32;
                let buckles = own.iter().any(|column| column.buckling.is_some());
                let along = if buckles { along_end } else { springs.packet_start(packet) };
                let root = if offsets.is_some() { end + number as u32 } else { end };
                factors.rows.push(Row { root, stride, along, columns, buckles });
                end += if offsets.is_some() { 0 } else { columns };
                along_end += if buckles { columns } else { 0 };
            }
            end += offsets.as_ref().map_or(0, |offsets| (offsets.len() * GROUP) as u32);
            factors.group_add(offsets);
        }
        factors.roots = vec![Entry([T::ZERO; LANES]); end as usize];
        factors.along = vec![Entry([T::ZERO; LANES]); along_end as usize];
        factors
    }

    fn group_add(&mut self, offsets: Option<Vec<i32>>) {
        self.groups.push(match offsets {
            None => NONE,
            Some(offsets) => {
                if self.offsets.last() != Some(&offsets) {
                    self.offsets.push(offsets);
                }
                self.offsets.len() as u32 - 1
            }
        });
    }

    /// The group that begins with a packet, if its packets have the same offsets.
    #[inline(always)]
    pub(super) fn group(&self, packet: usize) -> Option<Group<'_, T>> {
        let kind = self.groups[packet / GROUP];
        if kind == NONE {
            return None;
        }
        let Row { root, columns, .. } = self.rows[packet];
        let (start, columns) = (root as usize, columns as usize);
        let (roots, _) = self.roots[start..start + columns * GROUP].as_chunks();
        let along = std::array::from_fn(|number| self.along(packet + number));
        Some(Group { offsets: &self.offsets[kind as usize], roots, along })
    }

    /// The factors of the columns of a packet.
    #[inline(always)]
    pub(super) fn packet(&self, packet: usize) -> impl Iterator<Item = Factors<'_, T>> {
        let Row { root, stride, .. } = self.rows[packet];
        let roots = self.roots[root as usize..].iter().step_by(stride as usize);
        roots
            .zip(self.along(packet))
            .map(|(root, along)| Factors { root: &root.0, along: &along.0 })
    }

    #[inline(always)]
    fn along(&self, packet: usize) -> &[Entry<T>] {
        let Row { along, columns, .. } = self.rows[packet];
        &self.along[along as usize..][..columns as usize]
    }

    /// Brings what all springs of a kind share to a substep of `step` \[s\].
    pub(super) fn step_set(&mut self, springs: &SpringColumns<T>, step: T) {
        let square = step * step;
        let (shared, _) = self.along.split_at_mut(self.column_count);
        shared.par_iter_mut().zip(springs.columns()).for_each(|(along, column)| {
            for lane in 0..LANES {
                along.0[lane] = square * column.stiffness[lane] + step * column.damping[lane];
            }
        });
    }

    /// The factors of runs of `length` packets, a multiple of [`GROUP`], to write to.
    pub(super) fn tasks(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = FactorsTask<'_, T>> {
        let mut roots = self.roots.as_mut_slice();
        let mut along = &mut self.along[self.column_count..];
        let tasks: Vec<_> = self
            .rows
            .chunks(length)
            .map(|rows| {
                let columns = |row: &Row| row.columns as usize;
                let root_count = rows.iter().map(columns).sum();
                let along_count = rows.iter().filter(|row| row.buckles).map(columns).sum();
                FactorsTask {
                    rows,
                    roots: roots.split_off_mut(..root_count).unwrap_or_default(),
                    along: along.split_off_mut(..along_count).unwrap_or_default(),
                }
            })
            .collect();
        tasks.into_par_iter()
    }
}

/// The factors in some packets, to write to.
pub(super) struct FactorsTask<'a, T> {
    rows: &'a [Row],
    roots: &'a mut [Entry<T>],
    along: &'a mut [Entry<T>],
}

impl<T> FactorsTask<'_, T> {
    /// The roots of the columns of a packet, counted from the first of the task, and the stiffness along its springs
    /// if they buckle.
    #[inline(always)]
    pub(super) fn packet_mut(
        &mut self,
        number: usize,
    ) -> (impl Iterator<Item = &mut Lanes<T>>, Option<impl Iterator<Item = &mut Lanes<T>>>) {
        let Row { root, stride, along, columns, buckles } = self.rows[number];
        let start = (root - self.rows[0].root) as usize;
        let roots = self.roots[start..].iter_mut().step_by(stride as usize).take(columns as usize);
        let first = self.rows.iter().find(|row| row.buckles).map_or(0, |row| row.along);
        let along = buckles
            .then(|| self.along[(along - first) as usize..].iter_mut().take(columns as usize));
        (roots.map(|entry| &mut entry.0), along.map(|along| along.map(|entry| &mut entry.0)))
    }
}

/// The offsets of the columns of these packets, if there are as many as make a group, all have the same, and there
/// are any.
fn offsets_of_all<T: Real>(springs: &SpringColumns<T>, packets: &[usize]) -> Option<Vec<i32>> {
    let offset = |neighbours: &Neighbours| match neighbours {
        Neighbours::Offset(offset) => Some(*offset),
        Neighbours::Indices(_) => None,
    };
    let offsets_of = |packet: usize| -> Option<Vec<i32>> {
        springs.packet(packet).iter().map(|column| offset(&column.neighbours)).collect()
    };
    let first = offsets_of(packets[0])?;
    let is_same = |&packet: &usize| offsets_of(packet).as_ref() == Some(&first);
    (packets.len() == GROUP && !first.is_empty() && packets.iter().all(is_same)).then_some(first)
}
