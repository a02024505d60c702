//! The ways that the device has, so that it is given no more than what differs.

use std::ops::Range;

use crate::{Real, Result};

use super::{super::Ways, task::PairDevice};

/// Nodes that are given together.
const CHUNK: usize = 512;
/// Where more parts differ than this, all between the first and the last is given: each part costs as much as many nodes.
const PARTS_MAX: usize = 32;

/// The ways on a device: starts of all nodes, then ends, with a fourth number that is not 0 where a node is marked.
#[derive(Debug)]
pub(super) struct SentWays<T> {
    /// Chunks of nodes that have marks there.
    marked: Vec<usize>,
    /// Whether the device has the ways that were looked at last.
    is_there: bool,
    /// Whether all ways that it had have been replaced since this was last asked, those of nodes of bodies too.
    has_replaced: bool,
    numbers: Vec<[T; 4]>,
}

impl<T: Real> SentWays<T> {
    pub(super) const fn new() -> Self {
        Self { marked: Vec::new(), is_there: false, has_replaced: false, numbers: Vec::new() }
    }

    /// What the device has is not known any more.
    pub(super) const fn forget(&mut self) {
        self.is_there = false;
    }

    /// Whether all ways that the device had have been replaced since this was last asked.
    pub(super) const fn replaced_take(&mut self) -> bool {
        std::mem::replace(&mut self.has_replaced, false)
    }

    /// Notes that the device has the ways that are looked at, without marks.
    pub(super) fn are_there(&mut self) {
        self.marked.clear();
        self.is_there = true;
    }

    /// Gives the device these ways.
    pub(super) fn give(
        &mut self,
        device: &mut impl PairDevice<T>,
        ways: &Ways<'_, T>,
        marked: Option<&[bool]>,
    ) -> Result<()> {
        let parts = self.parts(ways, marked);
        let is_marked = |i: usize| marked.is_some_and(|marked| marked[i]);
        let count = ways.start.len();
        for part in parts {
            let (first, end) = (part.start, part.end.min(2 * count));
            let ends = first.max(count)..end.max(count);
            self.numbers.clear();
            self.numbers.extend((first..end.min(count)).map(|i| full(&ways.start[i], T::ZERO)));
            self.numbers.extend(ends.map(|i| {
                let i = i - count;
                full(&ways.end[i], if is_marked(i) { T::ONE } else { T::ZERO })
            }));
            device.ways_write(first, &self.numbers)?;
        }
        Ok(())
    }

    /// Which numbers the device lacks of these ways. It is given them.
    fn parts(&mut self, ways: &Ways<'_, T>, marked: Option<&[bool]>) -> Vec<Range<usize>> {
        let chunks = marked.into_iter().flat_map(|marked| marked.chunks(CHUNK)).enumerate();
        let has_marks = chunks.filter(|(_, chunk)| chunk.contains(&true));
        let now: Vec<_> = has_marks.map(|(chunk, _)| chunk).collect();
        let before = std::mem::replace(&mut self.marked, now.clone());
        let count = ways.start.len();
        if !(std::mem::replace(&mut self.is_there, true) && ways.follows) {
            self.has_replaced = true;
            return std::iter::once(0..2 * count).collect();
        }
        let mut chunks = [before, now].concat();
        chunks.sort_unstable();
        chunks.dedup();
        let parts = parts(&chunks).into_iter();
        parts.map(|part| count + part.start..count + part.end).collect()
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
    fn ends_are_given_where_marks_are_or_were() {
        let places = vec![[0.0_f32; 3]; 1500];
        let ways =
            |follows| Ways { start: &places, end: &places, delta: 0.0, is_new: false, follows };
        let marks = |at: usize| (0..1500).map(|i| i == at).collect::<Vec<bool>>();
        let mut sent = SentWays::new();
        let (all, of) = (0..3000, |chunk: usize| 1500 + 512 * chunk..1500 + 512 * (chunk + 1));
        let both = of(1).start..of(2).end;
        assert_eq!(sent.parts(&ways(true), None), std::slice::from_ref(&all), "it has none");
        sent.are_there();
        assert_eq!(sent.parts(&ways(true), Some(&marks(600))), [of(1)]);
        assert_eq!(sent.parts(&ways(true), Some(&marks(1499))), std::slice::from_ref(&both));
        assert_eq!(sent.parts(&ways(true), None), [of(2)], "without the mark");
        assert_eq!(sent.parts(&ways(true), None), []);
        assert_eq!(sent.parts(&ways(false), None), std::slice::from_ref(&all), "others");
    }
}
