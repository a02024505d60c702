//! Which interactions a particle takes part in.

use super::InteractionList;

/// For each particle the interactions of one kind that it is part of, ascending: what a gather sums over.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Incidence {
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

impl Incidence {
    /// Of the interactions of a list, among `count` particles. An interaction that has a particle in two places is in its row
    /// twice.
    #[must_use]
    pub fn new(list: &InteractionList<'_>, count: usize) -> Self {
        let mut offsets = vec![0_u32; count + 1];
        list.for_each(|particles| {
            particles.iter().for_each(|&particle| offsets[particle as usize + 1] += 1);
        });
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let mut entries = vec![0; offsets[count] as usize];
        let mut base = 0;
        list.for_each(|particles| {
            for (place, &particle) in particles.iter().enumerate() {
                let slot = &mut next[particle as usize];
                entries[*slot as usize] = base + place as u32;
                *slot += 1;
            }
            base += particles.len() as u32;
        });
        Self { offsets, entries }
    }

    /// The places of a particle: number of the interaction times the arity of its kind, plus the place in it; ascending.
    #[must_use]
    pub fn row(&self, particle: usize) -> &[u32] {
        &self.entries[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }

    /// Where the rows start, and the end of the last one.
    #[must_use]
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// The places of all particles, one row after the other.
    #[must_use]
    pub fn entries(&self) -> &[u32] {
        &self.entries
    }
}
