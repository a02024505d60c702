//! How the substeps of a frame are run: all of one length, or shorter ones where that is needed.

use crate::{
    AdaptiveSettings, AutoPreconditioner, Integrator, Kernels, Measures, Result, SolverConfig,
    SolverReport, State, TimeStepChange, TimeStepControl, TimeStepReason, error::Error,
};

use super::{FramePlan, FrameSpan, Substep, integrate};

/// The length of substeps at present.
#[derive(Clone, Debug)]
pub(super) struct TimeStep {
    control: TimeStepControl,
    /// The length of the settings \[s\].
    longest: f64,
    /// Times that it is halved.
    halvings: u32,
    /// Good substeps in a row since it was last changed; 0 while it is not halved.
    good: u32,
}

/// How a frame ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrameEnd {
    /// Substeps that stand.
    pub(super) substeps: u32,
    /// The substep that could not be done at any length, the last one.
    pub(super) broken: Option<Substep>,
}

impl TimeStep {
    pub(super) const fn new(config: &SolverConfig) -> Self {
        Self { control: config.time_step_control, longest: config.time_step, halvings: 0, good: 0 }
    }

    /// Goes on from a state.
    pub(super) fn upload(&mut self, state: &State) {
        if let TimeStepControl::Adaptive(settings) = self.control {
            self.halvings = state.time_step_halvings.min(settings.halvings_max);
            self.good = if self.halvings == 0 { 0 } else { state.time_step_good };
        }
    }

    /// What a state must know to go on from.
    pub(super) const fn download(&self, state: &mut State) {
        state.time_step_halvings = self.halvings;
        state.time_step_good = self.good;
    }

    /// The length \[s\].
    pub(super) fn length(&self) -> f64 {
        self.length_at(self.halvings)
    }

    fn length_at(&self, halvings: u32) -> f64 {
        self.longest / f64::from(1_u32 << halvings)
    }

    /// Runs a frame that starts after `step` substeps.
    ///
    /// # Errors
    /// Those of the stages.
    pub(super) fn frame<K: Kernels>(
        &mut self,
        kernels: &mut K,
        plan: &mut FramePlan,
        (span, step): (&FrameSpan<'_>, u64),
        report: &mut SolverReport,
    ) -> Result<FrameEnd> {
        let integrator = kernels.config().integrator.clone();
        // A frame may be the first one of a run that goes on: nothing of others counts.
        report.auto = AutoPreconditioner::default();
        match self.control {
            TimeStepControl::Fixed => {
                plan.refill(kernels.model(), span, (0.0, step), self.longest);
                fixed(kernels, plan, &integrator, report)
            }
            TimeStepControl::Adaptive(settings) => {
                let mut frame = AdaptiveFrame { settings, integrator, time_step: self, report };
                frame.run(kernels, plan, span, step)
            }
        }
    }

    /// Books a good substep. Returns whether the length has doubled.
    fn succeeded(&mut self, settings: &AdaptiveSettings) -> bool {
        if self.halvings == 0 {
            return false;
        }
        self.good += 1;
        let grows = self.good >= settings.grow_after;
        if grows {
            self.halvings -= 1;
            self.good = 0;
        }
        grows
    }

    /// Books a substep of `length` \[s\] that failed. Returns whether there is a shorter one.
    fn failed(&mut self, settings: &AdaptiveSettings, length: f64) -> bool {
        self.good = 0;
        // The last substep of a frame can be shorter than the others by more than a half already.
        let shorter = (self.halvings + 1..=settings.halvings_max)
            .find(|&halvings| self.length_at(halvings) < length);
        if let Some(halvings) = shorter {
            self.halvings = halvings;
        }
        shorter.is_some()
    }
}

/// Runs all substeps of a plan in one batch.
fn fixed<K: Kernels>(
    kernels: &mut K,
    plan: &FramePlan,
    integrator: &Integrator,
    report: &mut SolverReport,
) -> Result<FrameEnd> {
    kernels.frame_begin(plan)?;
    kernels.batch(|kernels| {
        let mut end = FrameEnd::default();
        for substep in &plan.substeps {
            if !integrate::substep(kernels, substep, integrator, report)? {
                return Ok(FrameEnd { broken: Some(*substep), ..end });
            }
            end.substeps += 1;
        }
        Ok::<_, Error>(end)
    })
}

/// A frame whose substeps are tried, and taken back where they fail.
struct AdaptiveFrame<'a> {
    settings: AdaptiveSettings,
    integrator: Integrator,
    time_step: &'a mut TimeStep,
    report: &'a mut SolverReport,
}

/// Why a substep failed, and whether its result can be gone on from nevertheless.
#[derive(Clone, Copy, Debug)]
struct SubstepFailure {
    reason: TimeStepReason,
    usable: bool,
}

impl AdaptiveFrame<'_> {
    fn run<K: Kernels>(
        &mut self,
        kernels: &mut K,
        plan: &mut FramePlan,
        span: &FrameSpan<'_>,
        step: u64,
    ) -> Result<FrameEnd> {
        let mut end = FrameEnd::default();
        let mut elapsed = 0.0;
        'plan: loop {
            let done = step + u64::from(end.substeps);
            plan.refill(kernels.model(), span, (elapsed, done), self.time_step.length());
            kernels.frame_begin(plan)?;
            for (index, substep) in plan.substeps.iter().enumerate() {
                let before = self.time_step.length();
                let (attempt, failure, pinched) = self.attempt(kernels, substep)?;
                let shorter =
                    failure.is_some() && self.time_step.failed(&self.settings, substep.length);
                self.report.add_attempt(&attempt, !shorter);
                if let Some(SubstepFailure { reason, usable }) = failure {
                    if shorter {
                        take_back(kernels, reason)?;
                        self.changed(substep.time, before, reason);
                        continue 'plan;
                    }
                    if let Some(pinched) = pinched {
                        return Err(pinched);
                    }
                    if !usable {
                        return Ok(FrameEnd { broken: Some(*substep), ..end });
                    }
                    self.report.substeps_failed += 1;
                }
                end.substeps += 1;
                elapsed += substep.length;
                if failure.is_none() && self.time_step.succeeded(&self.settings) {
                    let now = substep.time + substep.length;
                    self.changed(now, before, TimeStepReason::Recovered);
                    if index + 1 < plan.substeps.len() {
                        continue 'plan;
                    }
                }
            }
            return Ok(end);
        }
    }

    /// Tries a substep: what was done, what is wrong with it, and the error if bodies have pinched cloth in it. They may come slowly enough in a
    /// shorter one.
    fn attempt<K: Kernels>(
        &self,
        kernels: &mut K,
        substep: &Substep,
    ) -> Result<(SolverReport, Option<SubstepFailure>, Option<Error>)> {
        let mut attempt = SolverReport { auto: self.report.auto, ..SolverReport::default() };
        let done = kernels.batch(|kernels| {
            kernels.state_keep()?;
            integrate::substep(kernels, substep, &self.integrator, &mut attempt)
        });
        let done = match done {
            Err(
                error @ (Error::Pinched { .. }
                | Error::PinchedByBody { .. }
                | Error::BodyJumps { .. }),
            ) => {
                let failure = SubstepFailure { reason: TimeStepReason::Pinched, usable: false };
                return Ok((attempt, Some(failure), Some(error)));
            }
            done => done?,
        };
        let deferred = kernels.deferred_outcome()?;
        if deferred.broken.is_some() {
            kernels.control_forces_restore()?;
        }
        attempt.add_attempt(&deferred.report, true);
        let failure = if done && deferred.broken.is_none() {
            self.failure(&attempt, &kernels.measure()?)
        } else {
            let residual = attempt.residual;
            Some(SubstepFailure {
                reason: TimeStepReason::LinearSolver { residual },
                usable: false,
            })
        };
        Ok((attempt, failure, None))
    }

    /// What is wrong with the substep that led to this state, if anything is.
    fn failure(&self, attempt: &SolverReport, measures: &Measures) -> Option<SubstepFailure> {
        if measures.non_finite_particle.is_some() {
            return Some(SubstepFailure { reason: TimeStepReason::NonFinite, usable: false });
        }
        // Without a tolerance a number of iterations is asked for, not a residual.
        let tolerance = self.integrator.linear().map_or(0.0, |linear| linear.tolerance);
        let is_unconverged = tolerance > 0.0 && attempt.solves_unconverged > 0;
        let reason = if self.settings.needs_convergence && is_unconverged {
            TimeStepReason::LinearSolver { residual: attempt.residual }
        } else if measures.strain_max > self.settings.strain_max {
            TimeStepReason::Strain { strain: measures.strain_max }
        } else {
            return None;
        };
        Some(SubstepFailure { reason, usable: true })
    }

    /// Books a change of the length.
    fn changed(&mut self, time: f64, from: f64, reason: TimeStepReason) {
        let to = self.time_step.length();
        self.report.time_step_changes.push(TimeStepChange { time, from, to, reason });
    }
}

/// Takes a substep back that failed for this reason.
fn take_back<K: Kernels>(kernels: &mut K, reason: TimeStepReason) -> Result<()> {
    kernels.state_restore()?;
    kernels.control_forces_restore()?;
    // Kernels stand still once a number is not finite, until a state is written.
    if reason == TimeStepReason::NonFinite {
        let mut state = State::default();
        kernels.state_read(&mut state)?;
        kernels.state_write(&state)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: AdaptiveSettings = AdaptiveSettings {
        strain_max: 0.5,
        halvings_max: 3,
        grow_after: 2,
        needs_convergence: true,
    };

    fn time_step() -> TimeStep {
        TimeStep::new(&SolverConfig {
            time_step: 0.8,
            time_step_control: TimeStepControl::Adaptive(SETTINGS),
            ..SolverConfig::default()
        })
    }

    #[test]
    fn the_length_halves_to_its_limit_and_doubles_to_that_of_the_settings() {
        let mut time_step = time_step();
        for length in [0.4, 0.2, 0.1] {
            assert!(time_step.failed(&SETTINGS, time_step.length()));
            assert_eq!(time_step.length(), length);
        }
        assert!(!time_step.failed(&SETTINGS, 0.1));
        for length in [0.2, 0.4, 0.8] {
            assert!(!time_step.succeeded(&SETTINGS));
            assert!(time_step.succeeded(&SETTINGS));
            assert_eq!(time_step.length(), length);
        }
        assert!(!time_step.succeeded(&SETTINGS) && !time_step.succeeded(&SETTINGS));
        assert_eq!((time_step.length(), time_step.good), (0.8, 0));
    }

    #[test]
    fn a_failure_starts_the_count_again() {
        let mut time_step = time_step();
        assert!(time_step.failed(&SETTINGS, 0.8));
        assert!(!time_step.succeeded(&SETTINGS));
        assert!(time_step.failed(&SETTINGS, 0.4));
        assert!(!time_step.succeeded(&SETTINGS));
        assert!(time_step.succeeded(&SETTINGS));
        assert_eq!(time_step.length(), 0.4);
    }

    #[test]
    fn a_last_substep_that_is_short_already_gets_shorter_still() {
        let mut time_step = time_step();
        assert!(time_step.failed(&SETTINGS, 0.15));
        assert_eq!(time_step.length(), 0.1);
        assert!(!time_step.failed(&SETTINGS, 0.05));
    }

    #[test]
    fn a_state_has_no_more_halvings_than_the_settings_allow() {
        let mut time_step = time_step();
        time_step.upload(&State { time_step_halvings: 9, time_step_good: 1, ..State::default() });
        let mut state = State::default();
        time_step.download(&mut state);
        assert_eq!((state.time_step_halvings, state.time_step_good), (3, 1));
        time_step.control = TimeStepControl::Fixed;
        time_step.halvings = 0;
        time_step.upload(&state);
        assert_eq!(time_step.length(), 0.8, "a fixed time step has none");
    }
}
