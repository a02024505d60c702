//! Where the two factors of each spring are kept.
//!
//! Every particle has the factors of all its springs, in the order in which rows are summed up: packet by packet,
//! column by column, and where packets are worked on together column by column and then packet by packet. So they
//! are one stream of memory that is read from start to end. The vector u of a spring is
//! `root` times the difference of the positions of its ends, which change less often than they are read, so
//! that u is computed again wherever it is needed, always with the same bits.

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

/// u and e of NUMERICS §5 for one spring in each lane, u = root (x_j - x_i); zero in a lane without one.
/// Whole lines of the cache, so that loads touch one each.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Factors<T> {
    pub(super) root: Lanes<T>,
    pub(super) e: Lanes<T>,
}

/// The factors of all springs.
#[derive(Debug)]
pub(super) struct SpringFactors<T> {
    pub(super) entries: Vec<Factors<T>>,
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
    start: u32,
    /// From one column to the next.
    stride: u32,
    columns: u32,
}

/// Packets that have the same offsets: their factors column by column, and in each packet by packet.
pub(super) struct Group<'a, T> {
    pub(super) offsets: &'a [i32],
    pub(super) columns: &'a [[Factors<T>; GROUP]],
}

impl<T: Real> SpringFactors<T> {
    pub(super) fn new(springs: &SpringColumns<T>, count: usize) -> Self {
        let mut factors = Self {
            entries: Vec::new(),
            position: VectorField::new(count, springs.margin()),
            rows: Vec::new(),
            groups: Vec::new(),
            offsets: Vec::new(),
        };
        let mut end = 0;
        let packets: Vec<usize> = (0..springs.packet_count()).collect();
        for group in packets.chunks(GROUP) {
            let offsets = offsets_of_all(springs, group);
            let columns = |packet: usize| springs.packet(packet).len() as u32;
            for (number, &packet) in group.iter().enumerate() {
                let columns = columns(packet);
                let row = match &offsets {
                    Some(_) => Row { start: end + number as u32, stride: GROUP as u32, columns },
                    None => Row { start: end, stride: 1, columns },
                };
                factors.rows.push(row);
                end += if offsets.is_none() { columns } else { 0 };
            }
            end += offsets.as_ref().map_or(0, |offsets| (offsets.len() * GROUP) as u32);
            factors.group_add(offsets);
        }
        let empty = Factors { root: [T::ZERO; LANES], e: [T::ZERO; LANES] };
        factors.entries = vec![empty; end as usize];
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
        let Row { start, columns, .. } = self.rows[packet];
        let (start, columns) = (start as usize, columns as usize);
        let (columns, _) = self.entries[start..start + columns * GROUP].as_chunks();
        Some(Group { offsets: &self.offsets[kind as usize], columns })
    }

    /// The factors of the columns of a packet.
    #[inline(always)]
    pub(super) fn packet(&self, packet: usize) -> impl Iterator<Item = &Factors<T>> {
        let Row { start, stride, columns } = self.rows[packet];
        self.entries[start as usize..].iter().step_by(stride as usize).take(columns as usize)
    }

    /// The entries of runs of `length` packets, a multiple of [`GROUP`], to write to.
    pub(super) fn tasks(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = FactorsTask<'_, T>> {
        let mut rest = self.entries.as_mut_slice();
        let tasks: Vec<_> = self
            .rows
            .chunks(length)
            .map(|rows| {
                let count = rows.iter().map(|row| row.columns).sum::<u32>() as usize;
                FactorsTask { rows, entries: rest.split_off_mut(..count).unwrap_or_default() }
            })
            .collect();
        tasks.into_par_iter()
    }
}

/// The factors of some packets, to write to.
pub(super) struct FactorsTask<'a, T> {
    rows: &'a [Row],
    entries: &'a mut [Factors<T>],
}

impl<T> FactorsTask<'_, T> {
    /// The factors of the columns of a packet, counted from the first of the task.
    #[inline(always)]
    pub(super) fn packet_mut(&mut self, number: usize) -> impl Iterator<Item = &mut Factors<T>> {
        let Row { start, stride, columns } = self.rows[number];
        let start = (start - self.rows[0].start) as usize;
        self.entries[start..].iter_mut().step_by(stride as usize).take(columns as usize)
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
