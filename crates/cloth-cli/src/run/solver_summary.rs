//! What the solvers of a run did, in a line or two.

use cloth::{Integrator, Preconditioner, SolverReport, scene::CompiledScene};

use crate::units::count_text;

/// Sums over the frames of a run.
#[derive(Debug)]
pub(super) struct SolverSummary {
    solves: u64,
    unconverged: u64,
    iterations: u64,
    residual: f64,
    factorisations: u64,
    preconditioner: Option<Preconditioner>,
    halvings: u64,
    doublings: u64,
    /// Substeps that failed at the shortest time step and stand.
    failures: u64,
    /// Shortest time step after a change \[s\].
    shortest: f64,
}

impl SolverSummary {
    pub(super) const fn new() -> Self {
        Self {
            solves: 0,
            unconverged: 0,
            iterations: 0,
            residual: 0.0,
            factorisations: 0,
            preconditioner: None,
            halvings: 0,
            doublings: 0,
            failures: 0,
            shortest: f64::INFINITY,
        }
    }

    pub(super) fn add(&mut self, report: &SolverReport) {
        self.solves += u64::from(report.solves);
        self.unconverged += u64::from(report.solves_unconverged);
        self.iterations += report.iterations;
        self.residual = self.residual.max(report.residual);
        self.factorisations += u64::from(report.factorisations);
        self.preconditioner = report.preconditioner;
        self.failures += u64::from(report.substeps_failed);
        for change in &report.time_step_changes {
            let grows = change.to > change.from;
            self.doublings += u64::from(grows);
            self.halvings += u64::from(!grows);
            self.shortest = self.shortest.min(change.to);
        }
    }

    /// Which preconditioner `auto` has chosen, and why.
    pub(super) fn choice(&self, scene: &CompiledScene) -> Option<String> {
        let Integrator::Implicit(settings) = &scene.config.integrator else { return None };
        let chosen = self
            .preconditioner
            .filter(|_| settings.linear.preconditioner == Preconditioner::Auto)?;
        Some(format!("preconditioner {chosen}: {}", chosen.auto_reason(scene.simulated())))
    }

    /// Nothing for a run in which no linear system was solved and no time step changed.
    pub(super) fn lines(&self, substeps: u64) -> Vec<String> {
        let mut lines = Vec::new();
        if self.iterations > 0 {
            lines.push(format!(
                "{:.1} iterations per substep, worst residual {:.1e}, {} of {} unconverged",
                self.iterations as f64 / substeps.max(1) as f64,
                self.residual,
                self.unconverged,
                count_text(self.solves, "solve"),
            ));
        } else if self.solves > 0 {
            lines.push(format!("{}, none of them iterative", count_text(self.solves, "solve")));
        }
        if let Some(line) = lines.last_mut().filter(|_| self.factorisations > 0) {
            *line += &format!(", {}", count_text(self.factorisations, "factorisation"));
        }
        if self.halvings + self.doublings + self.failures > 0 {
            let mut line = format!(
                "time step halved {} and doubled {}",
                times_text(self.halvings),
                times_text(self.doublings),
            );
            if self.shortest.is_finite() {
                line += &format!(", at least {:.2e} s", self.shortest);
            }
            if self.failures > 0 {
                line +=
                    &format!("; {} failed at the shortest", count_text(self.failures, "substep"));
            }
            lines.push(line);
        }
        lines
    }
}

fn times_text(count: u64) -> String {
    count_text(count, "time")
}

#[cfg(test)]
mod tests {
    use cloth::{TimeStepChange, TimeStepReason};

    use super::*;

    fn lines(reports: &[SolverReport]) -> Vec<String> {
        let mut summary = SolverSummary::new();
        reports.iter().for_each(|report| summary.add(report));
        summary.lines(4)
    }

    #[test]
    fn nothing_is_said_of_an_explicit_run() {
        assert!(lines(&[SolverReport::default()]).is_empty());
    }

    #[test]
    fn sums_and_worst_values_are_those_of_the_run() {
        let report = |residual, solves_unconverged| SolverReport {
            solves: 2,
            solves_unconverged,
            iterations: 25,
            residual,
            ..SolverReport::default()
        };
        assert_eq!(
            lines(&[report(5e-4, 0), report(2e-2, 1)]),
            ["12.5 iterations per substep, worst residual 2.0e-2, 1 of 4 solves unconverged"]
        );
        let direct = SolverReport { solves: 1, factorisations: 2, ..SolverReport::default() };
        assert_eq!(lines(&[direct]), ["1 solve, none of them iterative, 2 factorisations"]);
    }

    #[test]
    fn changes_of_the_time_step_are_counted() {
        let change =
            |from, to| TimeStepChange { time: 0.0, from, to, reason: TimeStepReason::NonFinite };
        let report = SolverReport {
            time_step_changes: vec![change(0.02, 0.01), change(0.01, 0.005), change(0.005, 0.01)],
            substeps_failed: 1,
            ..SolverReport::default()
        };
        assert_eq!(
            lines(&[report]),
            [
                "time step halved 2 times and doubled 1 time, at least 5.00e-3 s; 1 substep failed at the shortest"
            ]
        );
    }
}
