//! What was changed, to be taken back and done again.

/// Changes that can be taken back.
const LENGTH: usize = 200;

/// A value and what it was before.
#[derive(Clone, Debug)]
pub(super) struct History<T> {
    past: Vec<T>,
    present: T,
    /// What was taken back, the last one first to be done again.
    future: Vec<T>,
}

impl<T: Clone + PartialEq> History<T> {
    pub(super) const fn new(present: T) -> Self {
        Self { past: Vec::new(), present, future: Vec::new() }
    }

    pub(super) const fn present(&self) -> &T {
        &self.present
    }

    /// Changes the value; whether it is another one. What was taken back cannot be done again then.
    pub(super) fn change(&mut self, next: T) -> bool {
        if next == self.present {
            return false;
        }
        self.past.push(std::mem::replace(&mut self.present, next));
        self.future.clear();
        if self.past.len() > LENGTH {
            self.past.remove(0);
        }
        true
    }

    /// Takes the last change back; the value, if there was a change.
    pub(super) fn undo(&mut self) -> Option<&T> {
        let before = self.past.pop()?;
        self.future.push(std::mem::replace(&mut self.present, before));
        Some(&self.present)
    }

    /// Does again what was taken back last; the value, if there was such a change.
    pub(super) fn redo(&mut self) -> Option<&T> {
        let after = self.future.pop()?;
        self.past.push(std::mem::replace(&mut self.present, after));
        Some(&self.present)
    }

    /// What came of a change: not always what was asked for. A change that was refused is none.
    pub(super) fn settle(&mut self, actual: T) {
        self.present = actual;
        if self.past.last() == Some(&self.present) {
            self.past.pop();
        }
        if self.future.last() == Some(&self.present) {
            self.future.pop();
        }
    }

    /// Number of changes that can be taken back.
    pub(super) const fn undo_count(&self) -> usize {
        self.past.len()
    }

    /// Number of changes that can be done again.
    pub(super) const fn redo_count(&self) -> usize {
        self.future.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_taken_back_and_done_again_in_order() {
        let mut history = History::new(0);
        assert!(history.change(1) && history.change(2) && history.change(3));
        assert_eq!(history.undo(), Some(&2));
        assert_eq!(history.undo(), Some(&1));
        assert_eq!(history.redo(), Some(&2));
        assert_eq!(history.undo(), Some(&1));
        assert_eq!(history.undo(), Some(&0));
        assert_eq!(history.undo(), None);
        assert_eq!(*history.present(), 0);
        for expected in [1, 2, 3] {
            assert_eq!(history.redo(), Some(&expected));
        }
        assert_eq!(history.redo(), None);
    }

    #[test]
    fn a_new_change_ends_what_could_be_done_again() {
        let mut history = History::new("a");
        history.change("b");
        history.change("c");
        history.undo();
        assert!(!history.change("b"), "nothing is different");
        assert_eq!(history.redo_count(), 1);
        assert!(history.change("d"));
        assert_eq!((history.redo_count(), history.undo_count()), (0, 2));
        assert_eq!(history.undo(), Some(&"b"));
    }

    #[test]
    fn a_change_that_was_refused_is_no_change() {
        let mut history = History::new(1);
        history.change(2);
        history.change(-9);
        history.settle(2);
        assert_eq!((*history.present(), history.undo_count()), (2, 1));
        assert_eq!(history.undo(), Some(&1));
        // Done again, it is refused, too.
        history.redo();
        history.settle(1);
        assert_eq!((*history.present(), history.undo_count()), (1, 0));
        // What came of it can be something else.
        history.change(5);
        history.settle(6);
        assert_eq!(history.undo(), Some(&1));
        assert_eq!(history.redo(), Some(&6));
    }

    #[test]
    fn the_history_is_bounded() {
        let mut history = History::new(0);
        (1..=1000).for_each(|value| assert!(history.change(value)));
        assert_eq!(history.undo_count(), LENGTH);
        while history.undo().is_some() {}
        assert_eq!(*history.present(), 1000 - LENGTH);
    }
}
