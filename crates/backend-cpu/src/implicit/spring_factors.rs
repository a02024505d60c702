//! Where the direction and the two factors of each spring are kept.
//!
//! A spring of an offset column is kept once, with its particle of smaller index: all springs of the
//! same offset are a band, arrays over particles. From its other particle it is seen at the same
//! offset back. So half the numbers of the full matrix are stored, and all of them are read in
//! order. Springs of index columns, and those that cross from such a packet into a regular one, are
//! kept twice, once for each particle.

use std::{collections::BTreeMap, ops::Range};

use cloth_core::Real;

use crate::{
    memory::{FieldView, LANES, Lanes, VectorField, lanes},
    springs::{Neighbours, SpringColumns},
};

/// A packet without a column in a band.
pub(super) const NONE: u32 = u32::MAX;

/// u and e of NUMERICS §5 for one spring in each lane; zero in a lane without one.
#[derive(Clone, Debug)]
pub(super) struct Factors<T> {
    pub(super) u: [Lanes<T>; 3],
    pub(super) e: Lanes<T>,
}

/// The springs of one offset.
#[derive(Debug)]
pub(super) struct Band<T> {
    pub(super) offset: usize,
    /// The particle that entry 0 belongs to, a multiple of [`LANES`].
    pub(super) first: usize,
    /// For each packet from there on, its column for this offset, or [`NONE`].
    pub(super) columns: Vec<u32>,
    pub(super) u: VectorField<T>,
    /// As long as a component of `u`, margins included.
    pub(super) e: Vec<T>,
}

/// Where a packet finds the factors of one of its columns.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// In a band, at the particle.
    Forward(u32),
    /// In a band, at the neighbour.
    Backward(u32),
    /// Among those of its own.
    Own(u32),
}

/// The factors of all springs.
#[derive(Debug)]
pub(super) struct SpringFactors<T> {
    pub(super) bands: Vec<Band<T>>,
    pub(super) own: Vec<Factors<T>>,
    /// Packet and column of each entry of `own`.
    pub(super) own_keys: Vec<[u32; 2]>,
    places: Vec<Place>,
    packets: Vec<Range<u32>>,
    /// The run that each packet belongs to, or [`NONE`].
    runs: Vec<u32>,
    /// The terms of each run.
    terms: Vec<Vec<Term>>,
}

/// A column as all packets of a run have it: a run is a row of packets with the same offsets, all in
/// bands. Lanes without a spring find zeros there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Term {
    /// From a particle to its neighbour.
    pub(super) offset: i32,
    band: u32,
}

impl<T: Real> SpringFactors<T> {
    pub(super) fn new(springs: &SpringColumns<T>) -> Self {
        let mut factors = Self {
            bands: bands(springs),
            own: Vec::new(),
            own_keys: Vec::new(),
            places: Vec::new(),
            packets: Vec::new(),
            runs: Vec::new(),
            terms: Vec::new(),
        };
        let band_of: BTreeMap<usize, u32> =
            factors.bands.iter().enumerate().map(|(b, band)| (band.offset, b as u32)).collect();
        for packet in 0..springs.packet_count() {
            let start = factors.places.len() as u32;
            for column in springs.packet_range(packet) {
                let place = match springs.columns()[column as usize].neighbours {
                    Neighbours::Offset(offset) if offset > 0 => {
                        Place::Forward(band_of[&(offset as usize)])
                    }
                    Neighbours::Offset(offset) if is_mirrored(springs, packet, column, offset) => {
                        Place::Backward(band_of[&(offset.unsigned_abs() as usize)])
                    }
                    _ => {
                        factors.own_keys.push([packet as u32, column]);
                        Place::Own(factors.own_keys.len() as u32 - 1)
                    }
                };
                factors.places.push(place);
            }
            factors.packets.push(start..factors.places.len() as u32);
        }
        let empty = Factors { u: [[T::ZERO; LANES]; 3], e: [T::ZERO; LANES] };
        factors.own = vec![empty; factors.own_keys.len()];
        factors.places.shrink_to_fit();
        factors.find_runs(springs);
        factors
    }

    fn find_runs(&mut self, springs: &SpringColumns<T>) {
        for packet in 0..springs.packet_count() {
            let start = self.packets[packet].start as usize;
            let terms: Option<Vec<Term>> = springs
                .packet(packet)
                .iter()
                .enumerate()
                .map(|(number, column)| match (&column.neighbours, self.places[start + number]) {
                    (Neighbours::Offset(offset), Place::Forward(band) | Place::Backward(band)) => {
                        Some(Term { offset: *offset, band })
                    }
                    _ => None,
                })
                .collect();
            self.runs.push(match terms {
                None => NONE,
                Some(terms) => {
                    if self.terms.last() != Some(&terms) {
                        self.terms.push(terms);
                    }
                    self.terms.len() as u32 - 1
                }
            });
        }
    }

    /// The number of packets from `packet` on, up to `end`, that are in one run, and its terms;
    /// `None` for a packet outside of runs.
    #[inline(always)]
    pub(super) fn run(&self, packet: usize, end: usize) -> Option<(usize, &[Term])> {
        let run = self.runs[packet];
        if run == NONE {
            return None;
        }
        let mut length = 1;
        while packet + length < end && self.runs[packet + length] == run {
            length += 1;
        }
        Some((length, &self.terms[run as usize]))
    }

    /// u and e of a term, for `length` particles from `first` on.
    #[inline(always)]
    pub(super) fn term(&self, term: Term, first: usize, length: usize) -> ([&[T]; 3], &[T]) {
        let band = &self.bands[term.band as usize];
        let at = first as isize + term.offset.min(0) as isize - band.first as isize;
        let start = band.u.margin().wrapping_add_signed(at);
        let end = start + length;
        let [x, y, z] = band.u.padded();
        ([&x[start..end], &y[start..end], &z[start..end]], &band.e[start..end])
    }

    /// Where the columns of a packet are among the places.
    #[inline(always)]
    pub(super) fn packet(&self, packet: usize) -> usize {
        self.packets[packet].start as usize
    }

    /// u and e of the column at a place, of the packet that starts at particle `first`.
    #[inline(always)]
    pub(super) fn at(&self, place: usize, first: usize) -> ([&Lanes<T>; 3], &Lanes<T>) {
        match self.places[place] {
            Place::Forward(band) => self.bands[band as usize].at(first, 0),
            Place::Backward(band) => {
                let band = &self.bands[band as usize];
                band.at(first, band.offset)
            }
            Place::Own(own) => {
                let factors = &self.own[own as usize];
                let [x, y, z] = &factors.u;
                ([x, y, z], &factors.e)
            }
        }
    }
}

impl<T: Real> Band<T> {
    /// The springs of the particles from `first - back` on.
    #[inline(always)]
    fn at(&self, first: usize, back: usize) -> ([&Lanes<T>; 3], &Lanes<T>) {
        let at = first as isize - back as isize - self.first as isize;
        let u = FieldView::new(&self.u).packet(at);
        (u, lanes(&self.e, self.u.margin().wrapping_add_signed(at)))
    }
}

/// A band for each positive offset, without numbers yet.
fn bands<T: Real>(springs: &SpringColumns<T>) -> Vec<Band<T>> {
    let mut columns: BTreeMap<usize, Vec<[u32; 2]>> = BTreeMap::new();
    for packet in 0..springs.packet_count() {
        for column in springs.packet_range(packet) {
            if let Neighbours::Offset(offset) = springs.columns()[column as usize].neighbours
                && offset > 0
            {
                columns.entry(offset as usize).or_default().push([packet as u32, column]);
            }
        }
    }
    let band = |(offset, entries): (usize, Vec<[u32; 2]>)| {
        let first = entries[0][0];
        let count = (entries[entries.len() - 1][0] - first + 1) as usize;
        let mut columns = vec![NONE; count];
        for [packet, column] in entries {
            columns[(packet - first) as usize] = column;
        }
        let u = VectorField::new(count * LANES, LANES);
        let e = vec![T::ZERO; u.padded()[0].len()];
        Band { offset, first: first as usize * LANES, columns, u, e }
    };
    columns.into_iter().map(band).collect()
}

/// Whether all springs of a column with a negative offset are in the band of the opposite offset,
/// which holds those of packets with offset columns.
fn is_mirrored<T: Real>(
    springs: &SpringColumns<T>,
    packet: usize,
    column: u32,
    offset: i32,
) -> bool {
    let active = &springs.columns()[column as usize].active;
    (0..LANES).filter(|&lane| active[lane] != T::ZERO).all(|lane| {
        let neighbour = (packet * LANES + lane) as i64 + i64::from(offset);
        let partner = neighbour as usize / LANES;
        springs
            .packet(partner)
            .iter()
            .any(|column| matches!(column.neighbours, Neighbours::Offset(back) if back == -offset))
    })
}
