//! Who acts on whom.

use rayon::prelude::*;

use super::Interactions;

/// Rows in a task.
const TASK: usize = 1024;

/// For each particle the others that an interaction couples it with: the pattern of a symmetric matrix without its diagonal, in
/// compressed sparse rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Neighbours {
    offsets: Vec<u32>,
    columns: Vec<u32>,
}

/// Moves the distinct numbers of an ascending row to its start, and returns how many these are.
fn distinct(row: &mut [u32]) -> usize {
    let mut kept = 0;
    for place in 0..row.len() {
        if kept == 0 || row[kept - 1] != row[place] {
            row[kept] = row[place];
            kept += 1;
        }
    }
    kept
}

impl Neighbours {
    /// Those of all given interactions.
    #[must_use]
    pub fn new(interactions: &Interactions<'_>) -> Self {
        let count = interactions.particle_count();
        // The larger particles of all pairs, by the smaller one: most pairs are there many times.
        let mut starts = vec![0_usize; count + 1];
        interactions.for_each_pair(|a, _| starts[a as usize + 1] += 1);
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut larger = vec![0; starts[count]];
        let mut next = starts.clone();
        interactions.for_each_pair(|a, b| {
            larger[next[a as usize]] = b;
            next[a as usize] += 1;
        });
        let mut rows = Vec::with_capacity(count);
        let mut rest = &mut *larger;
        for ends in starts.windows(2) {
            let row;
            (row, rest) = rest.split_at_mut(ends[1] - ends[0]);
            rows.push(row);
        }
        rows.par_iter_mut().with_min_len(TASK).for_each(|row| {
            row.sort_unstable();
            let kept = distinct(row);
            let whole = std::mem::take(row);
            *row = &mut whole[..kept];
        });
        let mut offsets = vec![0_u32; count + 1];
        for (a, row) in rows.iter().enumerate() {
            offsets[a + 1] += row.len() as u32;
            row.iter().for_each(|&b| offsets[b as usize + 1] += 1);
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut columns = vec![0; offsets[count] as usize];
        let mut next = offsets.clone();
        let mut put = |row: u32, column: u32| {
            let slot = &mut next[row as usize];
            columns[*slot as usize] = column;
            *slot += 1;
        };
        // A row gets its smaller columns before its larger ones, and both ascending.
        for (row, a) in rows.iter().zip(0..) {
            for &b in row.iter() {
                put(a, b);
                put(b, a);
            }
        }
        Self { offsets, columns }
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there is no particle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The neighbours of a particle, ascending.
    #[must_use]
    pub fn row(&self, particle: usize) -> &[u32] {
        &self.columns[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }

    /// Whether an interaction couples two particles.
    #[must_use]
    pub fn joins(&self, a: u32, b: u32) -> bool {
        self.row(a as usize).binary_search(&b).is_ok()
    }

    /// Each pair once, the smaller particle first, ascending.
    pub fn pairs(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        (0..self.len()).flat_map(move |i| {
            let later = self.row(i).iter().filter(move |&&j| j as usize > i);
            later.map(move |&j| [i as u32, j])
        })
    }
}
