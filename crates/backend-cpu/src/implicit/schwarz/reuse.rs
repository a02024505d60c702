//! When a preconditioner is built anew (NUMERICS §5).

/// Iterations may grow to this many times those of the first solve after it was built ...
const GROWTH: f64 = 1.5;

/// ... and these.
const GROWTH_MORE: f64 = 4.0;

/// What a preconditioner was built for.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::implicit) struct BuiltFor {
    /// Length of the substep \[s\].
    pub(in crate::implicit) length: f64,
    /// Whether each particle was held.
    pub(in crate::implicit) held: Vec<bool>,
}

/// Whether the preconditioner that is there is good enough.
#[derive(Debug, Default)]
pub(in crate::implicit) struct Reuse {
    built_for: Option<BuiltFor>,
    /// Iterations of the first solve since then.
    first: Option<u32>,
    is_slow: bool,
}

impl Reuse {
    /// Nothing of before counts: another frame, another state. So a run goes on from a checkpoint, which is one of a frame, as it
    /// would have without a stop.
    pub(in crate::implicit) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Whether it is to be built for this; it is taken to be built then.
    pub(in crate::implicit) fn wants_build(&mut self, built_for: BuiltFor) -> bool {
        if self.built_for.as_ref() == Some(&built_for) && !self.is_slow {
            return false;
        }
        *self = Self { built_for: Some(built_for), first: None, is_slow: false };
        true
    }

    /// Notes the iterations of a solve.
    pub(in crate::implicit) fn solved(&mut self, iterations: u32) {
        let first = f64::from(*self.first.get_or_insert(iterations));
        self.is_slow = f64::from(iterations) > GROWTH * first + GROWTH_MORE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_built_for_another_step_other_pins_and_when_it_gets_slow() {
        let built_for = |length, held| BuiltFor { length, held };
        let mut reuse = Reuse::default();
        assert!(reuse.wants_build(built_for(0.01, vec![false, true])));
        reuse.solved(20);
        assert!(!reuse.wants_build(built_for(0.01, vec![false, true])));
        assert!(reuse.wants_build(built_for(0.005, vec![false, true])));
        assert!(reuse.wants_build(built_for(0.005, vec![false, false])));
        reuse.solved(20);
        reuse.solved(34);
        assert!(!reuse.wants_build(built_for(0.005, vec![false, false])));
        reuse.solved(35);
        assert!(reuse.wants_build(built_for(0.005, vec![false, false])));
        reuse.forget();
        assert!(reuse.wants_build(built_for(0.005, vec![false, false])));
    }
}
