//! Rows of entries, one for each particle, such that equal ones are stored once.
//!
//! Rows that several particles have in common are stored once. All others are laid out in slices of [`SLICE`]
//! particles with the k-th entries side by side, so that neighbouring threads read neighbouring memory
//! (Monakov, Lokhmotov and Avetisyan 2010, "Automatically tuning sparse matrix-vector multiplication
//! for GPU architectures").

use std::{collections::HashMap, hash::Hash};

/// Particles of a slice.
const SLICE: usize = 32;
/// log2 of the distance between the entries of a row in a slice.
const SLICE_SHIFT: u32 = SLICE.trailing_zeros();
/// Rows that so many particles have in common are stored once.
const SHARED_MIN: u32 = 4;

/// All rows.
pub(super) struct Rows<T> {
    /// For each particle the first entry of its row and, packed, its entries (24 bits) and log2 of the
    /// distance between them (8 bits).
    pub(super) rows: Vec<[u32; 2]>,
    pub(super) entries: Vec<T>,
}

/// The rows that `row_of` makes for `count` particles.
pub(super) fn rows_of<T: Clone + Default + Eq + Hash>(
    count: usize,
    row_of: impl Fn(usize) -> Vec<T>,
) -> Rows<T> {
    let mut alike: HashMap<Vec<T>, (u32, Option<u32>)> = HashMap::new();
    for particle in 0..count {
        alike.entry(row_of(particle)).or_default().0 += 1;
    }
    let mut rows = vec![[0; 2]; count];
    let mut entries = Vec::new();
    let mut alone = Vec::new();
    for (particle, place) in rows.iter_mut().enumerate() {
        let row = row_of(particle);
        match alike.get_mut(&row) {
            Some((times, shared)) if *times >= SHARED_MIN => {
                let first = *shared.get_or_insert_with(|| {
                    entries.extend_from_slice(&row);
                    (entries.len() - row.len()) as u32
                });
                *place = [first, row.len() as u32];
            }
            _ => alone.push((particle, row)),
        }
    }
    for slice in alone.chunks(SLICE) {
        let start = entries.len();
        let longest = slice.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
        entries.resize(start + longest * SLICE, T::default());
        for (lane, (particle, row)) in slice.iter().enumerate() {
            rows[*particle] = [(start + lane) as u32, row.len() as u32 | SLICE_SHIFT << 24];
            for (k, entry) in row.iter().enumerate() {
                entries[start + k * SLICE + lane] = entry.clone();
            }
        }
    }
    Rows { rows, entries }
}
