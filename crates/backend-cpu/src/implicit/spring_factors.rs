//! Where the two factors of each spring are kept.
//!
//! Every particle has the factors of all its springs, packet by packet, column by column, in the order in
//! which rows are summed up: one stream of memory that is read from start to end. The vector u of a spring is
//! `root` times the difference of the positions of its ends, which change less often than they are read, so
//! that u is computed again wherever it is needed, always with the same bits.

use std::ops::Range;

use cloth_core::Real;
use rayon::prelude::*;

use crate::{
    memory::{LANES, Lanes, VectorField},
    springs::{Neighbours, SpringColumns},
};

/// A packet outside of runs.
const NONE: u32 = u32::MAX;

/// u and e of NUMERICS §5 for one spring in each lane, u = root (x_j - x_i); zero in a lane without one.
#[derive(Clone, Debug)]
pub(super) struct Factors<T> {
    pub(super) root: Lanes<T>,
    pub(super) e: Lanes<T>,
}

/// The factors of all springs.
#[derive(Debug)]
pub(super) struct SpringFactors<T> {
    /// Packets ascending, in each the columns ascending.
    pub(super) entries: Vec<Factors<T>>,
    /// The positions that they were computed at.
    pub(super) position: VectorField<T>,
    packets: Vec<Range<u32>>,
    /// The run that each packet belongs to, or [`NONE`].
    runs: Vec<u32>,
    /// For each run, the offsets from particles to their neighbours.
    offsets: Vec<Vec<i32>>,
}

impl<T: Real> SpringFactors<T> {
    pub(super) fn new(springs: &SpringColumns<T>, count: usize) -> Self {
        let mut end = 0;
        let mut range = |packet| {
            let start = end;
            end += springs.packet(packet).len() as u32;
            start..end
        };
        let packets = (0..springs.packet_count()).map(&mut range).collect();
        let empty = Factors { root: [T::ZERO; LANES], e: [T::ZERO; LANES] };
        let mut factors = Self {
            entries: vec![empty; end as usize],
            position: VectorField::new(count, springs.margin()),
            packets,
            runs: Vec::new(),
            offsets: Vec::new(),
        };
        factors.find_runs(springs);
        factors
    }

    /// A run is a row of packets with the same offsets.
    fn find_runs(&mut self, springs: &SpringColumns<T>) {
        for packet in 0..springs.packet_count() {
            let offset = |neighbours: &Neighbours| match neighbours {
                Neighbours::Offset(offset) => Some(*offset),
                Neighbours::Indices(_) => None,
            };
            let columns = springs.packet(packet).iter();
            let offsets: Option<Vec<i32>> =
                columns.map(|column| offset(&column.neighbours)).collect();
            self.runs.push(match offsets {
                None => NONE,
                Some(offsets) => {
                    if self.offsets.last() != Some(&offsets) {
                        self.offsets.push(offsets);
                    }
                    self.offsets.len() as u32 - 1
                }
            });
        }
    }

    /// The offsets of the run that all of `length` packets from `packet` on are in, if they are in one.
    #[inline(always)]
    pub(super) fn run(&self, packet: usize, length: usize) -> Option<&[i32]> {
        let runs = self.runs.get(packet..packet + length)?;
        let run = runs[0];
        let same = run != NONE && runs.iter().all(|&other| other == run);
        same.then(|| self.offsets[run as usize].as_slice())
    }

    /// The factors of the columns of a packet.
    #[inline(always)]
    pub(super) fn packet(&self, packet: usize) -> &[Factors<T>] {
        let range = &self.packets[packet];
        &self.entries[range.start as usize..range.end as usize]
    }

    /// The entries of runs of `length` packets.
    pub(super) fn tasks(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = &mut [Factors<T>]> {
        let mut rest = self.entries.as_mut_slice();
        let tasks: Vec<_> = self
            .packets
            .chunks(length)
            .map(|packets| {
                let count: usize = packets.iter().map(|range| range.len()).sum();
                rest.split_off_mut(..count).unwrap_or_default()
            })
            .collect();
        tasks.into_par_iter()
    }
}
