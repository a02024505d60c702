//! What a run of the checks did, and what it did not do.

use std::{fmt, time::Duration};

use crate::programs::Counts;

/// One check that was run.
pub(crate) struct StepOutcome {
    /// Name of the check.
    pub(crate) name: &'static str,
    /// Wall time it took.
    pub(crate) time: Duration,
    /// Why it failed, if it did.
    pub(crate) failure: Option<String>,
}

/// Account of all checks.
#[derive(Default)]
pub(crate) struct Summary {
    /// Checks that were run, in order.
    pub(crate) outcomes: Vec<StepOutcome>,
    /// The tests of all programs, and what they could not run here: that is listed, never left out in silence.
    pub(crate) counts: Counts,
}

impl Summary {
    /// Whether everything that was run succeeded.
    pub(crate) fn success(&self) -> bool {
        self.outcomes.iter().all(|outcome| outcome.failure.is_none())
    }
}

impl fmt::Display for Summary {
    /// A table, then one last line with the counts.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "\n{:<16} {:>9}  result", "check", "time")?;
        for StepOutcome { name, time, failure } in &self.outcomes {
            let result = match failure {
                None => "passed".to_owned(),
                Some(reason) => format!("FAILED ({reason})"),
            };
            writeln!(formatter, "{name:<16} {:>7.1} s  {result}", time.as_secs_f64())?;
        }
        let Counts { passed, failed, ignored, not_run } = &self.counts;
        for what in not_run {
            writeln!(formatter, "not run here: {what}")?;
        }
        writeln!(
            formatter,
            "\ntests: {passed} passed, {failed} failed, {} skipped",
            ignored + not_run.len()
        )?;
        let failed = self.outcomes.iter().filter(|outcome| outcome.failure.is_some()).count();
        writeln!(formatter, "checks: {} passed, {failed} failed", self.outcomes.len() - failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(failure: Option<&str>) -> StepOutcome {
        StepOutcome { name: "step", time: Duration::ZERO, failure: failure.map(Into::into) }
    }

    #[test]
    fn the_last_line_counts_and_one_failure_fails_all() {
        let mut summary = Summary::default();
        summary.outcomes.push(outcome(None));
        summary.counts = Counts::of("not run here: cuda: no device");
        assert!(summary.success());
        summary.outcomes.push(outcome(Some("exit status: 1")));
        assert!(!summary.success());
        let text = summary.to_string();
        assert!(text.contains("not run here: cuda: no device"));
        assert!(text.contains("tests: 0 passed, 0 failed, 1 skipped"));
        assert_eq!(text.lines().last(), Some("checks: 1 passed, 1 failed"));
    }
}
