//! Which solver advances a scene, and in which steps, where the scene does not say it.

use cloth_core::{Integrator, Model, SemiImplicitSettings};

use crate::{Scene, SceneSolver};

/// The solver of a compiled scene and the length of its substeps.
#[derive(Clone, Debug, PartialEq)]
pub struct SolverChoice {
    /// The solver.
    pub solver: SceneSolver,
    /// Length of a substep \[s\].
    pub time_step: f64,
    /// What was chosen, and why, in one line; empty if the scene gives both.
    pub reason: String,
    pub(super) is_chosen_step: bool,
}

/// Share of the stable time step that is taken.
const STABLE_SHARE: f64 = 0.9;

/// Explicit steps in a second of simulated time that take as long as implicit ones: what the table of
/// INTEGRATORS has for 160 x 160 particles, 53.5 ms for a sixtieth of a second against 2.90 ms for 17 steps, is 18,800.
/// The explicit solver keeps the motion that the other one damps, so that it has the first choice.
const STEPS_PER_SECOND: f64 = 18_000.0;

/// The same for fabric, whose triangles cost more in an explicit step than springs do: 70 x 70 cells of cotton took 4.3 ms for one, and
/// 98 ms for an implicit one of a sixtieth of a second. Contact of triangles costs as much in a step, whatever the cloth is made of.
const TRIANGLE_STEPS_PER_SECOND: f64 = 1_400.0;

/// Longest step of the implicit solver \[s\].
const IMPLICIT_STEP: f64 = 1.0 / 60.0;

/// Longest step of the semi-implicit solver \[s\]: colliders act after its step, so that cloth slides off, or
/// through, what it would have moved far into.
const SEMI_IMPLICIT_STEP: f64 = 1.0 / 240.0;

impl SolverChoice {
    /// Whether the length of the substeps was chosen for the model.
    #[must_use]
    pub const fn is_chosen_step(&self) -> bool {
        self.is_chosen_step
    }

    /// The choice for a scene, with the model that it describes. What the scene gives stays.
    pub(super) fn new(scene: &Scene, model: &Model) -> Self {
        let simulation = &scene.simulation;
        let frame = simulation.frames_per_second.recip();
        if let (None, Some(time_step)) = (simulation.solver, simulation.time_step) {
            let stable = model.stable_time_step_at_rest();
            if time_step > stable {
                let reason = format!(
                    "implicit, in steps of {time_step:.3e} s as given: explicit ones would diverge beyond {stable:.3e} s"
                );
                let solver = SceneSolver::Implicit;
                return Self { solver, time_step, reason, is_chosen_step: false };
            }
        }
        match simulation.solver_given() {
            Some(solver) => match simulation.time_step_given(solver) {
                Some(time_step) => {
                    Self { solver, time_step, reason: String::new(), is_chosen_step: false }
                }
                None => Self::step_for(solver, model, frame),
            },
            None => {
                let explicit = Self::step_for(SceneSolver::Explicit, model, frame);
                let steps = frame / explicit.time_step;
                let has_triangles = model.has_fabric() || model.has_triangle_contact();
                let most = if has_triangles { TRIANGLE_STEPS_PER_SECOND } else { STEPS_PER_SECOND };
                if steps <= most * frame {
                    let reason = format!("{}, which is the faster solver here", explicit.reason);
                    return Self { reason, ..explicit };
                }
                let solver = SceneSolver::Implicit;
                let implicit = match simulation.time_step_given(solver) {
                    Some(time_step) => {
                        let reason = format!("implicit, in steps of {time_step:.3e} s as given");
                        Self { solver, time_step, reason, is_chosen_step: false }
                    }
                    None => Self::step_for(solver, model, frame),
                };
                let reason = format!(
                    "{}; explicit steps would be {steps:.0} in a frame, which takes longer",
                    implicit.reason
                );
                Self { reason, ..implicit }
            }
        }
    }

    /// A solver with the step that suits the model, a whole number of times in a frame \[s\].
    fn step_for(solver: SceneSolver, model: &Model, frame: f64) -> Self {
        let (longest, why) = match solver {
            SceneSolver::Explicit => {
                let longest = STABLE_SHARE * model.stable_time_step();
                (longest, "nine tenths of what is stable in any shape of the cloth")
            }
            SceneSolver::Midpoint
                if !model.colliders().is_empty() || model.self_contact().is_some() =>
            {
                (SEMI_IMPLICIT_STEP, "as contacts act after each")
            }
            SceneSolver::Implicit | SceneSolver::Midpoint => {
                (IMPLICIT_STEP, "as any step is stable")
            }
            SceneSolver::SemiImplicit => {
                let integrator = Integrator::SemiImplicit(SemiImplicitSettings::default());
                match model.stable_time_step_of(&integrator) {
                    Some(stable) if STABLE_SHARE * stable < SEMI_IMPLICIT_STEP => (
                        STABLE_SHARE * stable,
                        "nine tenths of what is stable with this contact, drag and air",
                    ),
                    _ => (SEMI_IMPLICIT_STEP, "as colliders act after each"),
                }
            }
        };
        let steps = (frame / longest).ceil().max(1.0);
        let time_step = frame / steps;
        let name = solver.name();
        let reason = format!("{name}, in {steps:.0} steps of {time_step:.3e} s in a frame, {why}");
        Self { solver, time_step, reason, is_chosen_step: true }
    }
}
