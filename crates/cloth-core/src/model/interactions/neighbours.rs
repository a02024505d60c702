//! Who acts on whom.

use super::Interactions;

/// For each particle the others that an interaction couples it with: the pattern of a symmetric matrix without its diagonal, in
/// compressed sparse rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Neighbours {
    offsets: Vec<u32>,
    columns: Vec<u32>,
}

impl Neighbours {
    /// Those of all given interactions.
    #[must_use]
    pub fn new(interactions: &Interactions<'_>) -> Self {
        let count = interactions.particle_count();
        let mut pairs = Vec::new();
        interactions.for_each_pair(|a, b| pairs.push([a, b]));
        pairs.sort_unstable();
        pairs.dedup();
        pairs.retain(|[a, b]| a != b);
        let mut offsets = vec![0_u32; count + 1];
        for &particle in pairs.iter().flatten() {
            offsets[particle as usize + 1] += 1;
        }
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut columns = vec![0; 2 * pairs.len()];
        let mut next = offsets.clone();
        // Pairs are sorted by their smaller particle: a row gets its smaller columns before its larger ones, and both ascending.
        for [a, b] in pairs {
            for (row, column) in [(a, b), (b, a)] {
                let slot = &mut next[row as usize];
                columns[*slot as usize] = column;
                *slot += 1;
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
