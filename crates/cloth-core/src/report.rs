//! What a solver did in a frame, and the figures that prove it.

use std::time::Duration;

/// Account of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Simulated time at the end of the frame \[s\].
    pub time: f64,
    /// Substeps of this frame.
    pub substeps: u32,
    /// Iterations of the linear solver in this frame; 0 for the explicit integrator.
    pub solver_iterations: u64,
    /// Largest relative residual that the linear solver left; 0 for the explicit integrator.
    pub solver_residual: f64,
    /// Pairs of particles in contact at the last substep.
    pub contacts: u64,
    /// Entries of the candidate list at the end of the frame: pairs of particles, or of small groups
    /// of them, as the backend keeps it.
    pub contact_candidates: u64,
    /// Times that the candidate list was built in this frame.
    pub contact_rebuilds: u32,
    /// Figures of the state at the end of the frame.
    pub measures: Measures,
    /// Wall time by stage; stages that a backend fuses appear under the name of the fused stage.
    pub stage_times: Vec<StageTime>,
    /// Wall time of the frame.
    pub wall_time: Duration,
}

/// Figures of one state, computed by the stage `measure` (NUMERICS §10).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Some particle that is not, if there is one.
    pub non_finite_particle: Option<u32>,
    /// The substep in which that was first seen; the kernels stand still from then on.
    pub non_finite_step: Option<u64>,
    /// Largest relative elongation l/L - 1 of a spring.
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
