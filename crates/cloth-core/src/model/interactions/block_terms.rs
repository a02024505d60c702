//! Which triangles of fabric give something to which block of the matrix.

use rayon::prelude::*;

use super::{Incidence, InteractionKind, Interactions, Neighbours};
use crate::{Error, Result, fabric::bending::PATCH};

/// For each block on the diagonal and above it what it is the sum of, in the order of the sum: what a gather without a search reads.
///
/// The blocks of a row follow each other: that on the diagonal, then those of its neighbours, ascending; what is below the diagonal has no terms.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BlockTerms {
    /// The first block of each row, and the end.
    pub rows: Vec<u32>,
    /// Where the terms of each block begin, and the end of the last ones.
    pub offsets: Vec<u32>,
    /// 144 times the number of a triangle, plus 12 times the place of the row in it, plus that of the column; those of folds with [`Self::FOLDS`],
    /// behind those of triangles that stretch.
    pub terms: Vec<u32>,
}

/// What rows in turn have.
#[derive(Default)]
struct Rows {
    counts: Vec<u32>,
    terms: Vec<u32>,
}

impl BlockTerms {
    /// Marks a term of folds.
    pub const FOLDS: u32 = 1 << 31;
    /// Pairs of places of a triangle.
    const PAIRS: u32 = (PATCH * PATCH) as u32;

    /// Those of the triangles of fabric, whose neighbours are given.
    ///
    /// # Errors
    /// `Overflow` if there are more triangles than terms can tell apart.
    pub fn new(interactions: &Interactions<'_>, neighbours: &Neighbours) -> Result<Self> {
        let count = interactions.particle_count();
        let kinds = [(InteractionKind::Membrane, 0), (InteractionKind::Bending, Self::FOLDS)];
        let mut lists = Vec::new();
        for (kind, mark) in kinds {
            let Some(list) = interactions.list(kind) else { continue };
            let capacity = u64::from(Self::FOLDS / Self::PAIRS);
            if list.len() as u64 > capacity {
                let buffer = "terms of the matrix of fabric";
                return Err(Error::Overflow { buffer, needed: list.len() as u64, capacity });
            }
            let mut particles = Vec::with_capacity(kind.arity() * list.len());
            list.for_each(|corners| particles.extend_from_slice(corners));
            lists.push((Incidence::new(list, count), particles, kind.arity(), mark));
        }
        let of_row = |mut all: Rows, i: usize| {
            let row = neighbours.row(i);
            let mut found = Vec::new();
            for (incidence, particles, arity, mark) in &lists {
                for &at in incidence.row(i) {
                    let (number, own) = (at as usize / arity, at as usize % arity);
                    let corners = &particles[number * arity..(number + 1) * arity];
                    for (other, &j) in corners.iter().enumerate().filter(|(_, j)| **j as usize >= i)
                    {
                        let block = match j as usize == i {
                            true => 0,
                            // All corners are neighbours.
                            false => row.binary_search(&j).map_or(0, |place| place + 1),
                        };
                        let pair = (PATCH * own + other) as u32;
                        found.push((block, (Self::PAIRS * number as u32 + pair) | mark));
                    }
                }
            }
            found.sort_unstable();
            let first = all.counts.len();
            all.counts.resize(first + row.len() + 1, 0);
            found.iter().for_each(|(block, _)| all.counts[first + block] += 1);
            all.terms.extend(found.into_iter().map(|(_, term)| term));
            all
        };
        let join = |mut a: Rows, b: Rows| {
            a.counts.extend(b.counts);
            a.terms.extend(b.terms);
            a
        };
        let rows = (0..count).into_par_iter().with_min_len(256);
        let all = rows.fold(Rows::default, of_row).reduce(Rows::default, join);
        let ends = |counts: &mut dyn Iterator<Item = u32>| {
            let sum = |sum: &mut u32, count| {
                *sum += count;
                Some(*sum)
            };
            [0].into_iter().chain(counts.scan(0, sum)).collect()
        };
        Ok(Self {
            rows: ends(&mut (0..count).map(|i| neighbours.row(i).len() as u32 + 1)),
            offsets: ends(&mut all.counts.into_iter()),
            terms: all.terms,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::sheet;

    #[test]
    fn every_pair_of_places_of_a_triangle_is_a_term_of_one_block() {
        let model = sheet(6, f64::INFINITY);
        let neighbours = Neighbours::new(&model.interactions().of_fabric());
        let all = BlockTerms::new(&model.interactions(), &neighbours).unwrap();
        let mut seen = 0;
        for i in 0..model.particle_count() {
            let columns = [&[i as u32], neighbours.row(i)].concat();
            assert_eq!((all.rows[i + 1] - all.rows[i]) as usize, columns.len());
            for (block, j) in (all.rows[i] as usize..).zip(columns) {
                let terms =
                    &all.terms[all.offsets[block] as usize..all.offsets[block + 1] as usize];
                assert!(terms.is_sorted(), "triangles first, each kind ascending");
                for &term in terms {
                    let plain = (term & !BlockTerms::FOLDS) as usize;
                    let (number, pair) = (plain / (PATCH * PATCH), plain % (PATCH * PATCH));
                    let corners: &[u32] = match term & BlockTerms::FOLDS {
                        0 => &model.elements().triangles()[number].particles,
                        _ => &model.elements().patches()[number],
                    };
                    assert_eq!([corners[pair / PATCH], corners[pair % PATCH]], [i as u32, j]);
                    seen += 1;
                }
            }
        }
        assert_eq!(seen, all.terms.len());
        let pairs = |corners: &[u32]| -> usize {
            corners.iter().map(|i| corners.iter().filter(|j| *j >= i).count()).sum()
        };
        let triangles =
            model.elements().triangles().iter().map(|triangle| pairs(&triangle.particles));
        let patches = model.elements().patches().iter().map(|patch| pairs(patch));
        assert_eq!(seen, triangles.sum::<usize>() + patches.sum::<usize>());
    }
}
