//! The list of a device on the host, for the rounds in which a few particles are looked at again and again: none of them has to wait for the device.

use rayon::prelude::*;

use crate::{Real, Result};

use super::{
    super::{UnprovenPair, Ways},
    Moved,
    task::{PAIR_WORDS, PairDevice, PairTask, pair_of},
};

/// Longer lists take more time to be read than the device takes for some looks.
const PAIRS_MAX: u32 = 1 << 22;

/// Pairs that a thread looks at, at least.
const TASK: usize = 1 << 13;

/// A list as it was built last. Its memory is used again.
#[derive(Debug)]
pub(super) struct HostList<T> {
    /// Whether it is that of the device.
    is_valid: bool,
    pairs: Vec<[u32; PAIR_WORDS]>,
    /// Both sets of positions that it was built for.
    references: Vec<[T; 4]>,
}

/// The last look at all particles: what has moved since then is marked.
#[derive(Debug)]
pub(super) struct LastLook<T> {
    start: Vec<[T; 3]>,
    end: Vec<[T; 3]>,
    /// Starts and ends of the ways.
    moved: [Moved<T>; 2],
}

impl<T: Real> LastLook<T> {
    pub(super) fn new(ways: &Ways<'_, T>, moved: [Moved<T>; 2]) -> Self {
        Self { start: ways.start.to_vec(), end: ways.end.to_vec(), moved }
    }
}

/// Whether numbers are the same, without a branch for each of them.
fn are_equal<T: Real>(a: &[[T; 3]], b: &[[T; 3]]) -> bool {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    a.len() == b.len() && pairs.fold(true, |equal, (a, b)| equal & (a == b))
}

/// Whether unmarked particles are at the same places.
fn rest_is_at<T: Real>(a: &[[T; 3]], b: &[[T; 3]], marked: &[bool]) -> bool {
    let pairs = a.iter().zip(b).zip(marked);
    pairs.fold(true, |equal, ((a, b), marked)| {
        equal & (*marked | ((a[0] == b[0]) & (a[1] == b[1]) & (a[2] == b[2])))
    })
}

impl<T: Real> HostList<T> {
    pub(super) const fn new() -> Self {
        Self { is_valid: false, pairs: Vec::new(), references: Vec::new() }
    }

    /// The device has another list.
    pub(super) const fn forget(&mut self) {
        self.is_valid = false;
    }

    /// Reads the list, if it has changed. Returns whether it is one that is read at all.
    pub(super) fn read(
        &mut self,
        device: &mut impl PairDevice<T>,
        task: &PairTask<T>,
    ) -> Result<bool> {
        if self.is_valid || task.pair_count > PAIRS_MAX {
            return Ok(self.is_valid);
        }
        self.pairs.clear();
        if task.pair_count > 0 {
            device.list_read(task, &mut self.pairs)?;
        }
        device.references_read(task, &mut self.references)?;
        self.is_valid = true;
        Ok(true)
    }

    /// How far the ends of ways are from both sets of positions at most, if all that is not marked is where it was in the last look, or at its start.
    pub(super) fn moved(
        &self,
        last: &LastLook<T>,
        ways: &Ways<'_, T>,
        marked: &[bool],
    ) -> Option<Moved<T>> {
        if !are_equal(&last.start, ways.start) {
            return None;
        }
        let mut moved = if rest_is_at(ways.end, &last.end, marked) {
            last.moved[1]
        } else if rest_is_at(ways.end, ways.start, marked) {
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

    /// The unproven pairs of marked particles.
    pub(super) fn unproven(&self, ways: &Ways<'_, T>, marked: &[bool]) -> Vec<UnprovenPair> {
        let asked = (ways.delta, ways.is_new);
        let is_marked = |words: &&[u32; PAIR_WORDS]| words[..4].iter().any(|&i| marked[i as usize]);
        let all = self.pairs.par_iter().with_min_len(TASK).filter(is_marked).map(pair_of);
        all.filter(|pair| pair.is_unproven(ways.start, ways.end, asked)).collect()
    }
}
