//! Which interactions a particle takes part in.

use super::InteractionList;
use crate::NONE;

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
        Self::build(|visit| list.for_each(visit), count)
    }

    /// Of anything that consists of `N` of `count` others each; [`NONE`] is in no row.
    #[must_use]
    pub fn of<const N: usize>(list: &[[u32; N]], count: usize) -> Self {
        Self::build(|visit| list.iter().for_each(|members| visit(members)), count)
    }

    fn build(for_each: impl Fn(&mut dyn FnMut(&[u32])), count: usize) -> Self {
        let mut offsets = vec![0_u32; count + 1];
        for_each(&mut |members| {
            let present = members.iter().filter(|&&member| member != NONE);
            present.for_each(|&member| offsets[member as usize + 1] += 1);
        });
        for i in 0..count {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        let mut entries = vec![0; offsets[count] as usize];
        let mut base = 0;
        for_each(&mut |members| {
            for (place, &member) in members.iter().enumerate().filter(|(_, m)| **m != NONE) {
                let slot = &mut next[member as usize];
                entries[*slot as usize] = base + place as u32;
                *slot += 1;
            }
            base += members.len() as u32;
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
