//! The error of conjugate gradients in the norm of the energy, estimated as they run.

/// Terms that are kept.
const TERMS: usize = 64;

/// Iterations that the tail has at least.
const TAIL_MIN: usize = 4;

/// An estimate of sqrt(e A e), e the error of the present solution, relative to that of the first one.
///
/// An iteration lowers e A e by alpha gamma (Hestenes and Stiefel 1952, theorem 6:1). What the last iterations took away is
/// a lower bound of what the error was before them (Strakoš and Tichý 2002), and close to it if they took away most of it: here
/// the last quarter of all, four at least. The error now is smaller than it was then.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnergyEstimate {
    /// Sums of `stride` terms each; the last one may have fewer.
    sums: [f64; TERMS],
    stride: u32,
    filled: usize,
    /// Terms in the last sum.
    last: u32,
    /// What lay between the reference and the first solution.
    before: f64,
}

impl EnergyEstimate {
    /// For an iteration whose first solution is closer to the last one than the reference, by `before` in e A e.
    pub(crate) const fn new(before: f64) -> Self {
        Self { sums: [0.0; TERMS], stride: 1, filled: 0, last: 0, before }
    }

    /// Adds the term alpha gamma of an iteration.
    pub(crate) fn add(&mut self, term: f64) {
        if self.filled == 0 || self.last == self.stride {
            if self.filled == TERMS {
                for pair in 0..TERMS / 2 {
                    self.sums[pair] = self.sums[2 * pair] + self.sums[2 * pair + 1];
                }
                self.filled = TERMS / 2;
                self.stride *= 2;
            }
            self.sums[self.filled] = 0.0;
            self.filled += 1;
            self.last = 0;
        }
        self.sums[self.filled - 1] += term;
        self.last += 1;
    }

    /// The estimate, once there were enough iterations.
    pub(crate) fn relative(&self) -> Option<f64> {
        let tail = self.filled.div_ceil(4).max(TAIL_MIN);
        if self.filled <= tail {
            return None;
        }
        let sum = |terms: &[f64]| terms.iter().sum::<f64>();
        let all = self.before.max(0.0) + sum(&self.sums[..self.filled]);
        let share = sum(&self.sums[self.filled - tail..self.filled]) / all;
        (share >= 0.0).then(|| share.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_error_is_found() {
        for rate in [0.5_f64, 0.9, 0.99] {
            let mut estimate = EnergyEstimate::new(0.0);
            for iteration in 1..=400_i32 {
                estimate.add(rate.powi(iteration - 1) - rate.powi(iteration));
                let Some(found) = estimate.relative() else { continue };
                let now = rate.powi(iteration).sqrt();
                // That of a time between half of all iterations ago and now; and never below the error now by more than
                // a tail can miss.
                let half = rate.powi(iteration / 2 - 4).sqrt();
                assert!(found <= 1.01 * half, "{rate} {iteration}: {found} {half}");
                let missed = (1.0 - rate.powi((iteration / 4).max(4))).sqrt();
                assert!(found >= 0.99 * missed * now, "{rate} {iteration}: {found} {now}");
            }
        }
    }

    #[test]
    fn a_start_that_is_nearly_right_counts() {
        let mut estimate = EnergyEstimate::new(99.0);
        assert_eq!(estimate.relative(), None);
        for _ in 0..8 {
            estimate.add(0.125);
        }
        assert_eq!(estimate.relative(), Some((0.5_f64 / 100.0).sqrt()));
    }
}
