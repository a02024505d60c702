//! What a solver did in a frame, and the figures that prove it.

use std::time::Duration;

use crate::{Audit, AutoPreconditioner, LinearOutcome, Preconditioner};

/// Account of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Simulated time at the end of the frame \[s\].
    pub time: f64,
    /// Substeps of this frame.
    pub substeps: u32,
    /// What the solvers of the implicit integrators did.
    pub solver: SolverReport,
    /// Pairs of particles, or of features of triangles, in contact at the last substep.
    pub contacts: u64,
    /// Entries of the candidate list at the end of the frame: pairs of particles, or of small groups
    /// of them, as the backend keeps it.
    pub contact_candidates: u64,
    /// Times that the candidate list was built in this frame.
    pub contact_rebuilds: u32,
    /// Particles whose way contact of triangles has shortened, so that nothing passes and no triangle of fabric is stretched beyond its limit, all
    /// substeps together.
    pub contact_truncated: u64,
    /// Pairs of features of cloth that went through cloth from the start, which contact of triangles leaves out of its proof.
    pub contact_exempt: u64,
    /// Particles that bodies have pinched, and that are left inside of them ([`Pinch::Ghost`](crate::Pinch::Ghost)).
    pub contact_ghosts: u64,
    /// Figures of the state at the end of the frame.
    pub measures: Measures,
    /// How cloth lies at the end of the frame. Whoever downloads the state may fill it in; a
    /// [`Solver`](crate::Solver) leaves it empty.
    pub audit: Audit,
    /// Rigid bodies that would be faster than their solver lets them be.
    pub bodies_at_speed_limit: u32,
    /// Wall time by stage; stages that a backend fuses appear under the name of the fused stage.
    pub stage_times: Vec<StageTime>,
    /// Wall time of the frame.
    pub wall_time: Duration,
}

impl StepReport {
    /// Makes this the account of one part of a frame more: what was done adds up, and what is at the end is what it is at the end of `part`.
    pub fn add_part(&mut self, part: Self) {
        let before = std::mem::replace(self, part);
        self.substeps += before.substeps;
        self.contact_rebuilds += before.contact_rebuilds;
        self.contact_truncated += before.contact_truncated;
        self.wall_time += before.wall_time;
        for StageTime { stage, time } in before.stage_times {
            match self.stage_times.iter_mut().find(|entry| entry.stage == stage) {
                Some(entry) => entry.time += time,
                None => self.stage_times.push(StageTime { stage, time }),
            }
        }
        let part = std::mem::replace(&mut self.solver, before.solver);
        self.solver.add_attempt(&part, true);
        self.solver.constrained = part.constrained;
        self.solver.released += part.released;
        self.solver.substeps_failed += part.substeps_failed;
        self.solver.time_step_changes.extend(part.time_step_changes);
    }
}

/// What the solvers of the implicit integrators did in a frame, and the adaptive time step.
///
/// Solves, iterations and factorisations count all work, that of substeps that were taken back
/// included; residuals and solves above the tolerance are those of the substeps that stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolverReport {
    /// Linear systems solved.
    pub solves: u32,
    /// Those of them that stopped at the cap on iterations, above the tolerance.
    pub solves_unconverged: u32,
    /// Iterations of the linear solver, all solves together.
    pub iterations: u64,
    /// Largest relative residual |b - A y| / |b| that a linear solve left.
    pub residual: f64,
    /// Largest error in the norm of the energy that a linear solve left, relative to that of its start, where solves
    /// estimate it.
    pub energy_error: Option<f64>,
    /// Solves that went on with the diagonal, because rounding had made the preconditioner or the matrix indefinite.
    pub solves_restarted: u32,
    /// Preconditioner of the last conjugate gradients.
    pub preconditioner: Option<Preconditioner>,
    /// What [`Preconditioner::Auto`] stands for in the next solve of this frame.
    pub auto: AutoPreconditioner,
    /// Newton iterations, all substeps together.
    pub newton_iterations: u32,
    /// Largest residual of the nonlinear system, relative to that of the first Newton iteration; 0
    /// where one iteration was asked for.
    pub newton_residual: f64,
    /// Factorisations of the constant matrix of the semi-implicit integrator: one at the start, one
    /// for every change of the time step or of the particles held.
    pub factorisations: u32,
    /// Particles that colliders constrained in the last substep.
    pub constrained: u64,
    /// Contacts with colliders that were released, or began to slide, or slid with another drag,
    /// after a solve.
    pub released: u64,
    /// Substeps that failed at the shortest length of the adaptive time step and stand nevertheless.
    pub substeps_failed: u32,
    /// Decisions of the adaptive time step, in order. Each one to a shorter length took one substep
    /// back.
    pub time_step_changes: Vec<TimeStepChange>,
}

impl SolverReport {
    /// Adds a linear solve.
    pub(crate) fn add(&mut self, outcome: &LinearOutcome) {
        self.solves += 1;
        self.solves_unconverged += u32::from(!outcome.converged);
        self.iterations += u64::from(outcome.iterations);
        self.residual = self.residual.max(outcome.residual);
        self.energy_error = larger(self.energy_error, outcome.energy);
        self.solves_restarted += u32::from(outcome.restarted);
    }

    /// Adds an attempt at a substep: its work, and, if it stands, what it left behind.
    pub(crate) fn add_attempt(&mut self, attempt: &Self, stands: bool) {
        self.solves += attempt.solves;
        self.iterations += attempt.iterations;
        self.newton_iterations += attempt.newton_iterations;
        self.factorisations += attempt.factorisations;
        self.solves_restarted += attempt.solves_restarted;
        self.auto = attempt.auto;
        self.preconditioner = attempt.preconditioner.or(self.preconditioner);
        if stands {
            self.solves_unconverged += attempt.solves_unconverged;
            self.residual = self.residual.max(attempt.residual);
            self.energy_error = larger(self.energy_error, attempt.energy_error);
            self.newton_residual = self.newton_residual.max(attempt.newton_residual);
        }
    }
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.map_or(b, |a| Some(b.map_or(a, |b| a.max(b))))
}

/// A decision of the adaptive time step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeStepChange {
    /// Simulated time at which it holds \[s\].
    pub time: f64,
    /// Length of substeps before \[s\].
    pub from: f64,
    /// Length of substeps from then on \[s\].
    pub to: f64,
    /// Why.
    pub reason: TimeStepReason,
}

/// Why the time step changed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TimeStepReason {
    /// The linear solver broke down or missed its tolerance; with the relative residual it left.
    LinearSolver {
        /// The relative residual.
        residual: f64,
    },
    /// A position or velocity was not finite.
    NonFinite,
    /// A spring was longer than allowed.
    Strain {
        /// Its relative elongation.
        strain: f64,
    },
    /// What moves has pinched cloth.
    Pinched,
    /// Enough good substeps in a row.
    Recovered,
}

/// Figures of one state, computed by the stage `measure` (NUMERICS §10).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Some particle that is not, if there is one.
    pub non_finite_particle: Option<u32>,
    /// The substep in which that was first seen; the kernels stand still from then on.
    pub non_finite_step: Option<u64>,
    /// Largest relative elongation l/L - 1 of an edge or a diagonal: a spring whose strain is
    /// measured ([`Springs::strain_measured`](crate::Springs::strain_measured)).
    pub strain_max: f64,
    /// Mean of |l/L - 1| over all springs.
    pub strain_mean: f64,
    /// A particle of the spring with the largest elongation.
    pub strain_particle: u32,
    /// Deepest intrusion of a free particle into the thickness around a collider \[m\].
    pub penetration_max: f64,
    /// Kinetic energy \[J\].
    pub energy_kinetic: f64,
    /// Energy of the springs \[J\].
    pub energy_elastic: f64,
    /// Energy in the gravity and uniform fields, zero at the origin \[J\].
    pub energy_potential: f64,
    /// Linear momentum \[kg m/s\].
    pub momentum: [f64; 3],
    /// |sum of all spring forces| / sum of |spring force|: what internal forces wrongly add to the
    /// momentum, round-off only in a correct kernel.
    pub momentum_drift: f64,
}

impl Measures {
    /// Kinetic, elastic and potential energy together \[J\].
    #[must_use]
    pub fn energy(&self) -> f64 {
        self.energy_kinetic + self.energy_elastic + self.energy_potential
    }
}

/// Wall time that a stage took in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StageTime {
    /// Name of the stage, as in NUMERICS.
    pub stage: &'static str,
    /// Time in this frame.
    pub time: Duration,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_frame_add_up() {
        let stage =
            |stage, milliseconds| StageTime { stage, time: Duration::from_millis(milliseconds) };
        let part = |iterations, contacts, stage_times| StepReport {
            substeps: 2,
            contacts,
            contact_truncated: 5,
            stage_times,
            wall_time: Duration::from_millis(20),
            solver: SolverReport {
                solves: 3,
                iterations,
                auto: AutoPreconditioner::Block(iterations as u32),
                residual: 1.0 / iterations as f64,
                constrained: contacts,
                ..SolverReport::default()
            },
            ..StepReport::default()
        };
        let mut report = StepReport::default();
        report.add_part(part(10, 7, vec![stage("a", 1), stage("b", 2)]));
        report.add_part(part(40, 4, vec![stage("b", 3), stage("c", 4)]));
        let expected = StepReport {
            substeps: 4,
            contact_truncated: 10,
            stage_times: vec![stage("b", 5), stage("c", 4), stage("a", 1)],
            wall_time: Duration::from_millis(40),
            solver: SolverReport {
                solves: 6,
                auto: AutoPreconditioner::Block(40),
                residual: 0.1,
                ..part(50, 4, Vec::new()).solver
            },
            ..part(50, 4, Vec::new())
        };
        assert_eq!(report, expected);
    }
}
