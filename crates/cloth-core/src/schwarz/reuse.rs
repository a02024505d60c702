//! When a preconditioner is built anew (NUMERICS §5).

/// Iterations may grow to this many times those of the first solve after it was built ...
const GROWTH: f64 = 1.5;

/// ... and these.
const GROWTH_MORE: f64 = 4.0;

/// Whether the preconditioner that is there is good enough.
#[derive(Debug, Default)]
pub struct Reuse {
    is_built: bool,
    /// Iterations of the first solve since then.
    first: Option<u32>,
    is_slow: bool,
}

impl Reuse {
    /// Nothing of before counts: another substep, another state. So a run goes on from a checkpoint, which is one of a frame, as it
    /// would have without a stop.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Whether it is to be built; it is taken to be built then.
    pub fn wants_build(&mut self) -> bool {
        if self.is_built && !self.is_slow {
            return false;
        }
        *self = Self { is_built: true, first: None, is_slow: false };
        true
    }

    /// Notes the iterations of a solve.
    pub fn solved(&mut self, iterations: u32) {
        let first = f64::from(*self.first.get_or_insert(iterations));
        self.is_slow = f64::from(iterations) > GROWTH * first + GROWTH_MORE;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_built_once_and_when_it_gets_slow() {
        let mut reuse = Reuse::default();
        assert!(reuse.wants_build());
        reuse.solved(20);
        reuse.solved(34);
        assert!(!reuse.wants_build());
        reuse.solved(35);
        assert!(reuse.wants_build());
        assert!(!reuse.wants_build());
        reuse.forget();
        assert!(reuse.wants_build());
    }
}
