//! The list of a device on the host, for the rounds in which a few particles are looked at again and again: none of them has to wait for the device.

use crate::{Real, Result};

use super::{
    super::{UnprovenPair, Ways},
    Moved,
    task::{PairDevice, PairTask, pairs_of},
};

/// Longer lists take more time to be read than the device takes for some looks.
const PAIRS_MAX: u32 = 1 << 22;

/// More pairs than this are faster looked at by the device.
const LOOKS_MAX: usize = 1 << 14;

/// A list as it was built once.
#[derive(Debug)]
pub(super) struct HostList<T> {
    pairs: Vec<UnprovenPair>,
    /// The pairs of each particle.
    offsets: Vec<u32>,
    places: Vec<u32>,
    /// Both sets of positions that it was built for.
    references: Vec<[T; 4]>,
}

/// The last look at all particles: what has moved since then is marked.
#[derive(Debug)]
pub(super) struct LastLook<T> {
    pub(super) start: Vec<[T; 3]>,
    pub(super) end: Vec<[T; 3]>,
    /// Starts and ends of the ways.
    pub(super) moved: [Moved<T>; 2],
}

impl<T: Real> HostList<T> {
    /// Whether a list is read at all.
    pub(super) const fn takes(task: &PairTask<T>) -> bool {
        task.pair_count <= PAIRS_MAX
    }

    /// Reads the list.
    pub(super) fn read(device: &mut impl PairDevice<T>, task: &PairTask<T>) -> Result<Self> {
        let (mut words, mut references) = (Vec::new(), Vec::new());
        device.list_read(task, &mut words)?;
        device.references_read(task, &mut references)?;
        let pairs: Vec<_> = pairs_of(&words).collect();
        let mut offsets = vec![0_u32; task.node_count as usize + 1];
        for particle in pairs.iter().flat_map(|pair| pair.particles) {
            offsets[particle as usize + 1] += 1;
        }
        for i in 1..offsets.len() {
            offsets[i] += offsets[i - 1];
        }
        let mut next = offsets.clone();
        let mut places = vec![0; 4 * pairs.len()];
        for (number, pair) in pairs.iter().enumerate() {
            for particle in pair.particles {
                let place = &mut next[particle as usize];
                places[*place as usize] = number as u32;
                *place += 1;
            }
        }
        Ok(Self { pairs, offsets, places, references })
    }

    fn row(&self, particle: usize) -> &[u32] {
        &self.places[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }

    /// How far the ends of ways are from both sets of positions at most, if all that is not marked is where it was in the last look, or at its start.
    pub(super) fn moved(
        &self,
        last: &LastLook<T>,
        ways: &Ways<'_, T>,
        marked: &[bool],
    ) -> Option<Moved<T>> {
        if last.start != ways.start {
            return None;
        }
        let others = || (0..marked.len()).filter(|&i| !marked[i]);
        let is_at = |places: &[[T; 3]]| others().all(|i| ways.end[i] == places[i]);
        let mut moved = if is_at(&last.end) {
            last.moved[1]
        } else if is_at(ways.start) {
            last.moved[0]
        } else {
            return None;
        };
        let (first, second) = self.references.split_at(self.references.len() / 2);
        let place = |&[x, y, z, _]: &[T; 4]| [x, y, z];
        for i in (0..marked.len()).filter(|&i| marked[i]) {
            moved.include(ways.end[i], [place(&first[i]), place(&second[i])]);
        }
        Some(moved)
    }

    /// Adds the unproven pairs of marked particles, unless these have too many.
    pub(super) fn unproven(
        &self,
        ways: &Ways<'_, T>,
        marked: &[bool],
        out: &mut Vec<UnprovenPair>,
    ) -> bool {
        let all = || (0..marked.len()).filter(|&i| marked[i]);
        if all().map(|i| self.row(i).len()).sum::<usize>() > LOOKS_MAX {
            return false;
        }
        let asked = (ways.delta, ways.is_new);
        for particle in all() {
            for &number in self.row(particle) {
                let pair = self.pairs[number as usize];
                let first = pair.particles.iter().find(|&&i| marked[i as usize]);
                if first.is_some_and(|&first| first as usize == particle)
                    && pair.is_unproven(ways.start, ways.end, asked)
                {
                    out.push(pair);
                }
            }
        }
        true
    }
}
