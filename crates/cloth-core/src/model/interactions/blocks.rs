//! Which blocks of a kernel read particles of which others.

use std::collections::BTreeSet;

use super::Interactions;

/// For each block of particles the others that it shares an interaction with, and so must wait for between two substeps. Symmetric,
/// as interactions are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockDependencies {
    /// Where the row of each block starts, and the end.
    pub rows: Vec<u32>,
    /// The other blocks, ascending in each row.
    pub blocks: Vec<u32>,
}

impl BlockDependencies {
    /// For `count` blocks, of which `block_of` says which one a particle is in.
    ///
    /// # Panics
    /// If it names a block beyond `count`.
    #[must_use]
    pub fn new(
        interactions: &Interactions<'_>,
        count: usize,
        block_of: impl Fn(usize) -> usize,
    ) -> Self {
        let mut sets = vec![BTreeSet::new(); count];
        interactions.for_each_pair(|a, b| {
            let [a, b] = [a, b].map(|particle| block_of(particle as usize));
            if a != b {
                sets[a].insert(b as u32);
                sets[b].insert(a as u32);
            }
        });
        let mut rows = vec![0];
        let mut blocks = Vec::new();
        for set in sets {
            blocks.extend(set);
            rows.push(blocks.len() as u32);
        }
        Self { rows, blocks }
    }
}
