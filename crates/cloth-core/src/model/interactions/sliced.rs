//! A static pattern of rows for devices that read many rows at once.

use super::Neighbours;

/// Rows of a slice.
const SLICE: usize = 32;

/// The columns of [`Neighbours`] in slices of 32 rows (sliced ELLPACK; Monakov, Lokhmotov and Avetisyan 2010): all rows of a slice have as many
/// entries as the longest of them, and the entries of one number lie side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlicedRows {
    /// For each slice the number of its first entry, and the end; an entry has a place for each row.
    pub slices: Vec<u32>,
    /// Columns: entry e of row i is at 32 e + i mod 32; `u32::MAX` behind the last one of a row.
    pub columns: Vec<u32>,
}

impl SlicedRows {
    /// Rows in a slice.
    pub const SLICE: usize = SLICE;

    /// The rows of `neighbours`.
    #[must_use]
    pub fn new(neighbours: &Neighbours) -> Self {
        let count = neighbours.len();
        let (mut slices, mut columns) = (vec![0], Vec::new());
        for first in (0..count).step_by(SLICE) {
            let rows = || (first..(first + SLICE).min(count)).map(|i| neighbours.row(i));
            let length = rows().map(<[u32]>::len).max().unwrap_or(0);
            let start = columns.len();
            columns.resize(start + length * SLICE, u32::MAX);
            for (lane, row) in rows().enumerate() {
                for (entry, &column) in row.iter().enumerate() {
                    columns[start + entry * SLICE + lane] = column;
                }
            }
            slices.push((columns.len() / SLICE) as u32);
        }
        Self { slices, columns }
    }

    /// Entries of all slices.
    #[must_use]
    pub const fn entry_count(&self) -> usize {
        self.columns.len() / SLICE
    }

    /// Entries and columns of a row, columns ascending.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, u32)> {
        let [first, end] = [0, 1].map(|k| self.slices[i / SLICE + k] as usize);
        let entries =
            (first..end).map(move |entry| (entry, self.columns[entry * SLICE + i % SLICE]));
        entries.take_while(|&(_, column)| column != u32::MAX)
    }

    /// Which of the columns is that one of a row.
    #[must_use]
    pub fn place(&self, i: u32, column: u32) -> Option<u32> {
        let (slice, lane) = (i as usize / SLICE, i as usize % SLICE);
        let [mut low, mut high] = [0, 1].map(|k| self.slices[slice + k] as usize);
        let at = |entry: usize| entry * SLICE + lane;
        while low < high {
            let middle = low.midpoint(high);
            if self.columns[at(middle)] < column {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let is_there = low < self.slices[slice + 1] as usize && self.columns[at(low)] == column;
        is_there.then(|| at(low) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cloth, GridPatch, MaterialPreset, ModelBuilder};

    #[test]
    fn rows_are_those_of_the_neighbours() {
        let patch = GridPatch::horizontal(9, 0.02, 0.0);
        let cloth = Cloth::grid("cloth", patch, &MaterialPreset::JERSEY);
        let model = ModelBuilder::new().cloth(cloth).build().unwrap();
        let neighbours = Neighbours::new(&model.interactions());
        let rows = SlicedRows::new(&neighbours);
        assert_eq!(rows.slices.len(), 81_usize.div_ceil(32) + 1);
        assert_eq!(rows.entry_count() as u32, rows.slices[3]);
        for i in 0..81 {
            assert!(rows.row(i).map(|(_, column)| column).eq(neighbours.row(i).iter().copied()));
            for j in 0..81 {
                let place = rows.row(i).find(|&(_, column)| column == j);
                let expected = place.map(|(entry, _)| (entry * 32 + i % 32) as u32);
                assert_eq!(rows.place(i as u32, j), expected);
            }
        }
    }
}
