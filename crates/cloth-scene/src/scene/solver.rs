//! How the state of a scene is advanced.

use cloth_core::{
    AdaptiveSettings, ImplicitSettings, LinearMethod, LinearStop, MatrixForm, MidpointSettings,
    NewtonSettings, Preconditioner, SemiImplicitSettings, SemiImplicitSolve,
};
use serde::{Deserialize, Serialize};

use super::named;

/// How the state is advanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SceneSolver {
    /// Symplectic Euler, in steps of `simulation.time_step`.
    Explicit,
    /// Backward Euler, in steps of `simulation.implicit.time_step`.
    Implicit,
    /// The implicit midpoint rule with damping, in steps of `simulation.midpoint.time_step`.
    Midpoint,
    /// Backward Euler with a constant matrix, in steps of `simulation.semi_implicit.time_step`.
    SemiImplicit,
}

impl SceneSolver {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Explicit, Self::Implicit, Self::SemiImplicit, Self::Midpoint];

    /// Its name on the command line and in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Implicit => "implicit",
            Self::SemiImplicit => "semi-implicit",
            Self::Midpoint => "midpoint",
        }
    }
}

impl std::str::FromStr for SceneSolver {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.iter().copied().find(|solver| solver.name() == name).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|solver| solver.name()).collect();
            format!("unknown solver {name:?}: use {}", names.join(" or "))
        })
    }
}

/// Settings of the implicit solver. They wait for `simulation.solver` to choose it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneImplicit {
    /// Length of a substep \[s\]; if not given, a sixtieth of a second, or less where springs are so stiff that
    /// the linear systems would need too many iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time_step: Option<f64>,
    /// Method for the linear systems: `cg` (the default), `jacobi` or `direct`.
    #[serde(with = "named")]
    #[cfg_attr(test, schemars(schema_with = "named::schema::<LinearMethod>"))]
    pub linear: LinearMethod,
    /// Preconditioner of `cg`: `diagonal`, `block`, `incomplete-cholesky`, `schwarz`, whose iterations hardly grow with the number
    /// of particles, or `auto` (the default): `block`, and for large pieces of fabric on the CPU and on CUDA `schwarz` in frames in which that
    /// shows itself to be faster.
    #[serde(with = "named")]
    #[cfg_attr(test, schemars(schema_with = "named::schema::<Preconditioner>"))]
    pub preconditioner: Preconditioner,
    /// How the matrix is multiplied: `matrix-free` (the default) or `assembled`.
    #[serde(with = "named")]
    #[cfg_attr(test, schemars(schema_with = "named::schema::<MatrixForm>"))]
    pub matrix: MatrixForm,
    /// What an iteration measures to know when to stop: `residual` (the default), or `energy` with `cg`, the error in the norm
    /// of the energy.
    #[serde(with = "named")]
    #[cfg_attr(test, schemars(schema_with = "named::schema::<LinearStop>"))]
    pub stop: LinearStop,
    /// What `stop` measures, relative to the start, at which an iteration stops, 0 to 1; 0.001 if not given, 0 runs to the cap.
    #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
    pub tolerance: f64,
    /// Cap on iterations of each solve; 1000 if not given.
    #[cfg_attr(test, schemars(range(min = 1, max = 10_000)))]
    pub iterations: u32,
    /// Whether an iteration starts from the answer of the substep before; off if not given.
    pub warm_start: bool,
    /// Iterations of Newton's method in each substep; 1, the linearised step, if not given.
    #[cfg_attr(test, schemars(range(min = 1, max = 100)))]
    pub newton_iterations: u32,
    /// Relative residual at which Newton's method stops, 0 to 1; 0.001 if not given.
    #[cfg_attr(test, schemars(range(min = 0.0, max = 1.0)))]
    pub newton_tolerance: f64,
    /// Solves of a substep at most, because colliders pulled and let go; 4 if not given.
    #[cfg_attr(test, schemars(range(min = 1, max = 100)))]
    pub constraint_passes: u32,
}

impl Default for SceneImplicit {
    fn default() -> Self {
        let ImplicitSettings { linear, newton, constraint_passes } = ImplicitSettings::default();
        let NewtonSettings { iterations_max, tolerance } = newton;
        Self {
            time_step: None,
            linear: linear.method,
            preconditioner: Preconditioner::Auto,
            matrix: linear.matrix,
            stop: linear.stop,
            tolerance: linear.tolerance,
            iterations: linear.iterations_max,
            warm_start: linear.warm_start,
            newton_iterations: iterations_max,
            newton_tolerance: tolerance,
            constraint_passes,
        }
    }
}

/// Settings of the midpoint solver. They wait for `simulation.solver` to choose it; its linear systems are solved as
/// `simulation.implicit` says.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneMidpoint {
    /// Length of a substep \[s\]; if not given, a sixtieth of a second, or a 240th where there are colliders or contact, which
    /// act after each.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time_step: Option<f64>,
    /// Where in a substep forces are taken, 0.5 to 1; 0.6 if not given. What is fast against a substep loses all but
    /// (1 - weight) / weight of its amplitude in each.
    #[cfg_attr(test, schemars(range(min = 0.5, max = 1.0)))]
    pub weight: f64,
}

impl Default for SceneMidpoint {
    fn default() -> Self {
        Self { time_step: None, weight: MidpointSettings::default().weight }
    }
}

/// Settings of the semi-implicit solver. They wait for `simulation.solver` to choose it.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneSemiImplicit {
    /// Length of a substep \[s\]; if not given, a 240th of a second, or less where contact by penalty, drag or air
    /// need it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub time_step: Option<f64>,
    /// How the constant system is solved: `factorisation` (the default) or `dense-inverse`.
    #[serde(with = "named")]
    #[cfg_attr(test, schemars(schema_with = "named::schema::<SemiImplicitSolve>"))]
    pub solve: SemiImplicitSolve,
}

impl Default for SceneSemiImplicit {
    fn default() -> Self {
        Self { time_step: None, solve: SemiImplicitSettings::default().solve }
    }
}

/// The adaptive time step of all solvers: substeps that go wrong are done again, shorter.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SceneAdaptive {
    /// Largest relative elongation of a spring that a substep may end with; 0.5 if not given.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0.0)))]
    pub strain_max: f64,
    /// Times that the time step may be halved, at most 20; 8 if not given.
    #[cfg_attr(test, schemars(range(max = 20)))]
    pub halvings: u32,
    /// Good substeps in a row after which it doubles; 4 if not given.
    #[cfg_attr(test, schemars(range(min = 1)))]
    pub grow_after: u32,
}

impl Default for SceneAdaptive {
    fn default() -> Self {
        let AdaptiveSettings { strain_max, halvings_max, grow_after, .. } =
            AdaptiveSettings::default();
        Self { strain_max, halvings: halvings_max, grow_after }
    }
}
