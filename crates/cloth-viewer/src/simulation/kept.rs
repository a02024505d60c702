//! Frames that are kept, within a budget of memory.

use std::collections::VecDeque;

/// Frames in a row, the oldest of which make room for new ones.
#[derive(Debug)]
pub(super) struct KeptFrames<T> {
    frames: VecDeque<Kept<T>>,
    /// Number of the oldest one.
    first: u64,
    bytes: u64,
    budget: u64,
}

#[derive(Debug)]
struct Kept<T> {
    frame: T,
    bytes: u64,
}

/// Which frames are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptView {
    /// Numbers of the first and the last one; `None` if a single frame is more than the budget.
    pub range: Option<[u64; 2]>,
    /// Memory that they take \[byte\].
    pub bytes: u64,
    /// Memory that they may take \[byte\].
    pub budget: u64,
}

impl<T> KeptFrames<T> {
    /// Nothing yet, and never more than `budget` bytes.
    pub(super) const fn new(budget: u64) -> Self {
        Self { frames: VecDeque::new(), first: 0, bytes: 0, budget }
    }

    /// Keeps frame `number` of this size. Those after it, and all of them if it is not the next one, are no longer its past
    /// and go; then the oldest ones, until there is room. Gives back those that went.
    pub(super) fn push(&mut self, number: u64, frame: T, bytes: u64) -> Vec<T> {
        let mut gone = if number >= self.first && number <= self.end() {
            self.truncate(number)
        } else {
            self.clear()
        };
        if self.frames.is_empty() {
            self.first = number;
        }
        if bytes > self.budget {
            gone.extend(self.clear());
            gone.push(frame);
            return gone;
        }
        while self.bytes + bytes > self.budget {
            let Some(oldest) = self.frames.pop_front() else { break };
            self.first += 1;
            self.bytes -= oldest.bytes;
            gone.push(oldest.frame);
        }
        self.bytes += bytes;
        self.frames.push_back(Kept { frame, bytes });
        gone
    }

    /// Forgets frame `number` and all after it; gives them back.
    pub(super) fn truncate(&mut self, number: u64) -> Vec<T> {
        let count = number.saturating_sub(self.first).min(self.frames.len() as u64) as usize;
        let gone: Vec<Kept<T>> = self.frames.drain(count..).collect();
        self.bytes -= gone.iter().map(|kept| kept.bytes).sum::<u64>();
        gone.into_iter().map(|kept| kept.frame).collect()
    }

    /// Forgets all; gives them back.
    pub(super) fn clear(&mut self) -> Vec<T> {
        self.bytes = 0;
        self.frames.drain(..).map(|kept| kept.frame).collect()
    }

    /// A frame by its number.
    pub(super) fn get(&self, number: u64) -> Option<&T> {
        let index = usize::try_from(number.checked_sub(self.first)?).ok()?;
        self.frames.get(index).map(|kept| &kept.frame)
    }

    /// Which there are.
    pub(super) fn view(&self) -> KeptView {
        let range = (!self.frames.is_empty()).then(|| [self.first, self.end() - 1]);
        KeptView { range, bytes: self.bytes, budget: self.budget }
    }

    /// Number of the frame that would be the next one.
    fn end(&self) -> u64 {
        self.first + self.frames.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_frames_make_room() {
        let mut kept = KeptFrames::new(35);
        let mut gone = Vec::new();
        for number in 0..10_u64 {
            gone.extend(kept.push(number, number, 10));
            assert!(kept.view().bytes <= 35);
        }
        assert_eq!(kept.view(), KeptView { range: Some([7, 9]), bytes: 30, budget: 35 });
        assert_eq!(gone, [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(
            (kept.get(6), kept.get(7), kept.get(9), kept.get(10)),
            (None, Some(&7), Some(&9), None)
        );
    }

    /// Who goes on from an earlier frame has another future.
    #[test]
    fn a_frame_that_is_computed_again_replaces_what_came_after_it() {
        let mut kept = KeptFrames::new(1000);
        for number in 0..6 {
            kept.push(number, ("old", number), 10);
        }
        assert_eq!(kept.push(3, ("new", 3), 20), [("old", 3), ("old", 4), ("old", 5)]);
        assert_eq!(kept.view(), KeptView { range: Some([0, 3]), bytes: 50, budget: 1000 });
        assert_eq!(kept.get(3), Some(&("new", 3)));
        // A gap is no past.
        kept.push(7, ("new", 7), 20);
        assert_eq!(kept.view().range, Some([7, 7]));
        kept.push(0, ("start", 0), 20);
        assert_eq!(kept.view().range, Some([0, 0]));
    }

    #[test]
    fn a_frame_above_the_budget_is_not_kept() {
        let mut kept = KeptFrames::new(15);
        kept.push(0, 'a', 10);
        assert_eq!(kept.push(1, 'b', 16), ['a', 'b']);
        assert_eq!(kept.view(), KeptView { range: None, bytes: 0, budget: 15 });
        kept.push(2, 'c', 15);
        assert_eq!(kept.view().range, Some([2, 2]));
    }
}
