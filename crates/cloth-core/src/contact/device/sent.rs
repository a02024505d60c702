//! The ways that the device has, so that it is given no more than what differs.

use std::ops::Range;

use rayon::prelude::*;

use crate::{Real, Result};

use super::{super::Ways, task::PairDevice};

/// Nodes that are compared, and given, together.
const CHUNK: usize = 512;
/// Chunks in a task.
const TASK: usize = 16;
/// Where more parts differ than this, all between the first and the last is given: each part costs as much as many nodes.
const PARTS_MAX: usize = 32;

/// The ways on a device: starts of all nodes, then ends, with a fourth number that is not 0 where a node is marked.
#[derive(Debug)]
pub(super) struct SentWays<T> {
    numbers: Vec<[T; 4]>,
    /// Whether the device has them.
    is_there: bool,
}

impl<T: Real> SentWays<T> {
    pub(super) const fn new() -> Self {
        Self { numbers: Vec::new(), is_there: false }
    }

    /// What the device has is not known any more.
    pub(super) const fn forget(&mut self) {
        self.is_there = false;
    }

    /// Notes that the device has these ways, without marks.
    pub(super) fn are_there(&mut self, ways: &Ways<'_, T>) {
        self.update(ways, None);
        self.is_there = true;
    }

    /// Gives the device these ways.
    pub(super) fn give(
        &mut self,
        device: &mut impl PairDevice<T>,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
    ) -> Result<()> {
        let was_there = std::mem::replace(&mut self.is_there, true);
        let mut changed = self.update(ways, marked);
        if !was_there {
            changed = (0..self.numbers.len().div_ceil(CHUNK)).collect();
        }
        parts(&changed).into_iter().try_for_each(|part| {
            let end = part.end.min(self.numbers.len());
            device.ways_write(part.start, &self.numbers[part.start..end])
        })
    }

    /// Takes in other ways. Returns which chunks are others now.
    fn update(&mut self, ways: &Ways<'_, T>, marked: Option<&[bool]>) -> Vec<usize> {
        let count = ways.start.len();
        self.numbers.resize(2 * count, [T::ZERO; 4]);
        let is_marked = |i: usize| marked.is_some_and(|marked| marked[i]);
        let number = |i: usize| match i.checked_sub(count) {
            None => full(&ways.start[i], T::ZERO),
            Some(i) => full(&ways.end[i], if is_marked(i) { T::ONE } else { T::ZERO }),
        };
        let chunks = self.numbers.par_chunks_mut(CHUNK).enumerate().with_min_len(TASK);
        let changed = chunks.filter_map(|(chunk, numbers)| {
            let mut changes = false;
            for (k, own) in numbers.iter_mut().enumerate() {
                let other = number(chunk * CHUNK + k);
                changes |= *own != other;
                *own = other;
            }
            changes.then_some(chunk)
        });
        changed.collect()
    }
}

fn full<T: Copy>(&[x, y, z]: &[T; 3], w: T) -> [T; 4] {
    [x, y, z, w]
}

/// The nodes of these chunks, those side by side together, and all between them if there are too many.
fn parts(chunks: &[usize]) -> Vec<Range<usize>> {
    let runs = chunks.chunk_by(|a, b| a + 1 == *b);
    let parts: Vec<_> = runs.map(|run| CHUNK * run[0]..CHUNK * (run[run.len() - 1] + 1)).collect();
    match &*parts {
        [first, .., last] if parts.len() > PARTS_MAX => {
            std::iter::once(first.start..last.end).collect()
        }
        _ => parts,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_given_in_few_parts() {
        assert_eq!(parts(&[]), []);
        assert_eq!(parts(&[0, 1, 2, 7]), [0..3 * CHUNK, 7 * CHUNK..8 * CHUNK]);
        let scattered: Vec<usize> = (3..80).step_by(2).collect();
        let all = 3 * CHUNK..80 * CHUNK;
        assert_eq!(parts(&scattered), std::slice::from_ref(&all));
    }

    #[test]
    fn a_change_of_a_place_or_a_mark_is_seen() {
        let start = vec![[0.0_f32; 3]; 1500];
        let mut end = start.clone();
        let mut sent = SentWays::new();
        fn ways<'a>(start: &'a [[f32; 3]], end: &'a [[f32; 3]]) -> Ways<'a, f32> {
            Ways { start, end, delta: 0.0, is_new: false }
        }
        sent.are_there(&ways(&start, &end));
        assert!(sent.update(&ways(&start, &end), None).is_empty());
        end[600][2] = 1.0;
        assert_eq!(sent.update(&ways(&start, &end), None), [2100 / CHUNK]);
        let marked: Vec<bool> = (0..1500).map(|i| i == 1499).collect();
        assert_eq!(sent.update(&ways(&start, &end), Some(&marked)), [2999 / CHUNK]);
        assert_eq!(sent.update(&ways(&start, &end), None), [2999 / CHUNK]);
    }
}
