//! How long and how finely a scene is simulated.

use serde::{Deserialize, Serialize};

use super::{SceneAdaptive, SceneImplicit, SceneMidpoint, SceneSemiImplicit, SceneSolver};

/// Frames, time step and solver.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneSimulation {
    /// Number of frames; 150 if not given.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub frames: u32,
    /// Frames in a second of simulated time \[Hz\]; 30 if not given.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub frames_per_second: f64,
    /// Length of a substep of the explicit solver \[s\]; nine tenths of what is stable in any shape of the cloth if
    /// not given. The others have a `time_step` in their own tables, as a step that suits one suits no other.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time_step: Option<f64>,
    /// How the state is advanced: `explicit`, `implicit`, `semi-implicit` or `midpoint`. If not given, `explicit` where
    /// `time_step` is given and not so long that it would diverge, `implicit` with that step where it is, and else the faster one of both
    /// ([`SolverChoice`](crate::SolverChoice)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver: Option<SceneSolver>,
    /// Precision of the arithmetic.
    pub precision: ScenePrecision,
    /// Relative elongation of a spring above which the run counts as diverged; 10 if not given.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub strain_bound: f64,
    /// Strain limiting after every substep; off if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strain_limit: Option<SceneStrainLimit>,
    /// Adaptive time step of the chosen solver. If not given, implicit steps in contact of triangles are halved up to six times where bodies pinch
    /// cloth or it would end far beyond its limit, `{ halvings = 0 }` prevents that, and others are fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<SceneAdaptive>,
    /// Settings of the implicit solver.
    pub implicit: SceneImplicit,
    /// Settings of the semi-implicit solver.
    pub semi_implicit: SceneSemiImplicit,
    /// Settings of the midpoint solver.
    pub midpoint: SceneMidpoint,
}

impl Default for SceneSimulation {
    fn default() -> Self {
        Self {
            frames: 150,
            frames_per_second: 30.0,
            time_step: None,
            solver: None,
            precision: ScenePrecision::default(),
            strain_bound: 10.0,
            strain_limit: None,
            adaptive: None,
            implicit: SceneImplicit::default(),
            semi_implicit: SceneSemiImplicit::default(),
            midpoint: SceneMidpoint::default(),
        }
    }
}

impl SceneSimulation {
    /// The solver that the scene says, in so many words or by giving a time step for the explicit one; `None`
    /// if it is left to the model.
    #[must_use]
    pub fn solver_given(&self) -> Option<SceneSolver> {
        self.solver.or(self.time_step.map(|_| SceneSolver::Explicit))
    }

    /// Length of a substep \[s\] that the scene gives for a solver.
    #[must_use]
    pub const fn time_step_given(&self, solver: SceneSolver) -> Option<f64> {
        match solver {
            SceneSolver::Explicit => self.time_step,
            SceneSolver::Implicit => self.implicit.time_step,
            SceneSolver::Midpoint => self.midpoint.time_step,
            SceneSolver::SemiImplicit => self.semi_implicit.time_step,
        }
    }

    /// Gives the length of a substep \[s\] of the solver that the scene says, or of the explicit one.
    pub fn time_step_set(&mut self, time_step: f64) {
        let place = match self.solver_given() {
            None | Some(SceneSolver::Explicit) => &mut self.time_step,
            Some(SceneSolver::Implicit) => &mut self.implicit.time_step,
            Some(SceneSolver::Midpoint) => &mut self.midpoint.time_step,
            Some(SceneSolver::SemiImplicit) => &mut self.semi_implicit.time_step,
        };
        *place = Some(time_step);
    }
}

/// Precision of the arithmetic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ScenePrecision {
    /// 32-bit floating point.
    #[default]
    F32,
    /// 64-bit floating point.
    F64,
}

/// Springs and triangles of fabric that are too long are shortened after every substep.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneStrainLimit {
    /// Largest length in units of the rest length, at least 1; 1.1 if not given. Of fabric, the largest principal stretch.
    #[cfg_attr(test, schemars(range(min = 1.0, max = 1e6)))]
    pub ratio: f64,
    /// Sweeps over all springs and triangles in each substep; 1 if not given.
    #[cfg_attr(test, schemars(range(min = 1, max = 1000)))]
    pub sweeps: u32,
    /// Classes of springs that are limited; stretch and shear if not given.
    pub classes: Vec<SceneSpringClass>,
}

impl Default for SceneStrainLimit {
    fn default() -> Self {
        Self {
            ratio: 1.1,
            sweeps: 1,
            classes: vec![SceneSpringClass::Stretch, SceneSpringClass::Shear],
        }
    }
}

/// What a spring is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum SceneSpringClass {
    /// Along the threads, or along the edges of a triangle mesh.
    Stretch,
    /// Across the diagonals of a grid.
    Shear,
    /// Across two threads, or between the vertices opposite to an edge.
    Bend,
}
