//! Of what each block of the matrix that fabric fills is the sum (NUMERICS §11, §12).

use rayon::prelude::*;

use super::{FabricElements, SlicedRows};

/// Marks what a fold adds; what triangles add has no mark.
pub const OF_FOLD: u32 = 1 << 31;
/// Where the number of a triangle or fold begins in a term, above the places of both particles in it, of two bits each.
pub const TERM_SHIFT: u32 = 4;

/// Elements in a task.
const TASK: usize = 1024;

/// For each place of some rows what the block there is the sum of, in this order: triangles that stretch, then folds, each ascending. A device
/// has a thread for each place, which needs nobody else.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FabricTerms {
    /// Where the terms of each place begin, and the end; places are those of [`SlicedRows::columns`].
    pub offsets: Vec<u32>,
    /// The number of a triangle or fold, the place of the particle of the row in it, and that of the column.
    pub terms: Vec<u32>,
}

impl FabricTerms {
    /// The terms of triangles and folds in rows that have all their pairs.
    #[must_use]
    pub fn new(elements: &FabricElements, rows: &SlicedRows) -> Self {
        let triangles = elements.triangles().par_iter().map(|triangle| triangle.particles);
        let folds = elements.folds().par_iter().map(|fold| fold.particles);
        let mut places = terms(triangles, 0, rows);
        places.append(&mut terms(folds, OF_FOLD, rows));
        let mut offsets = vec![0_u32; rows.columns.len() + 1];
        places.iter().for_each(|&[place, _]| offsets[place as usize + 1] += 1);
        for place in 0..rows.columns.len() {
            offsets[place + 1] += offsets[place];
        }
        let mut next = offsets.clone();
        let mut all = vec![0; places.len()];
        for [place, term] in places {
            let slot = &mut next[place as usize];
            all[*slot as usize] = term;
            *slot += 1;
        }
        Self { offsets, terms: all }
    }
}

/// Places and terms of elements of one kind, ascending by elements.
fn terms<const N: usize>(
    elements: impl IndexedParallelIterator<Item = [u32; N]>,
    mark: u32,
    rows: &SlicedRows,
) -> Vec<[u32; 2]> {
    let of_element = |(number, particles): (usize, [u32; N])| {
        let mut all = Vec::with_capacity(N * (N - 1));
        for (own, &row) in particles.iter().enumerate() {
            for (other, &column) in particles.iter().enumerate() {
                if let Some(place) = rows.place(row, column) {
                    let term = (number as u32) << TERM_SHIFT | (own << 2 | other) as u32;
                    all.push([place, mark | term]);
                }
            }
        }
        all
    };
    elements.enumerate().with_min_len(TASK).flat_map_iter(of_element).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Neighbours, example::sheet};

    #[test]
    fn each_block_has_the_terms_of_its_two_particles() {
        let model = sheet(7, 1.1);
        let elements = model.elements();
        let rows = SlicedRows::new(&Neighbours::new(&model.interactions().of_fabric()));
        let FabricTerms { offsets, terms } = FabricTerms::new(elements, &rows);
        let mut found = 0;
        for i in 0..model.particle_count() {
            for (entry, column) in rows.row(i) {
                let place = entry * SlicedRows::SLICE + i % SlicedRows::SLICE;
                let own = &terms[offsets[place] as usize..offsets[place + 1] as usize];
                assert!(!own.is_empty() && own.is_sorted(), "triangles come before folds");
                for term in own {
                    let number = ((term & !OF_FOLD) >> TERM_SHIFT) as usize;
                    let particles = match term & OF_FOLD {
                        0 => &elements.triangles()[number].particles[..],
                        _ => &elements.folds()[number].particles[..],
                    };
                    let [a, b] = [term >> 2 & 3, term & 3].map(|place| particles[place as usize]);
                    assert_eq!([a, b], [i as u32, column]);
                }
                found += own.len();
            }
        }
        assert_eq!(found, 6 * elements.triangles().len() + 12 * elements.folds().len());
        assert_eq!(found, terms.len());
    }
}
