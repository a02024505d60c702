//! Reference backend: every stage of NUMERICS as a plain loop in double precision.
//!
//! What other backends do with packets, tiles and fused kernels is here one short function for each stage, in a file of its
//! name, to be read beside the text. [`ReferenceBackend`] runs them: any scene, slowly, on one thread. The tests of all
//! backends run the same functions on numbers that carry a bound of their rounding error: [`Number`] is either.

mod aerodynamic_forces;
mod bending;
mod buckling;
mod collider_response;
mod contact;
mod control_forces;
mod field_forces;
mod implicit;
mod integrate_explicit;
mod kernels;
mod matrix;
mod measure;
mod membrane;
mod number;
mod particles;
mod procedural_forces;
mod semi_implicit;
mod sparse_cholesky;
mod spring_forces;
mod strain_limit;
mod stretch_limit;
mod surface;
mod triangle_contact;
mod vector;
mod vertex_normals;

/// How it works, with the table of its forms.
pub mod how_it_works {
    #![doc = include_str!("../BACKEND.md")]
}

use std::sync::Arc;

use cloth_core::{
    Backend, BackendInfo, Error, ImplicitSettings, Integrator, Kernels, LinearMethod,
    MidpointSettings, Model, Precision, Preconditioner, Result, SemiImplicitSolve, Solver,
    SolverConfig, stepper::SteppedSolver,
};

pub use aerodynamic_forces::{aerodynamic_forces, air_jacobians};
pub use bending::{bending_forces, bending_linearise};
pub use buckling::{spring_energy_doubled, spring_tension, spring_tension_derivative};
pub use collider_response::{Impulse, PathStart, collide, collider_response, penetration_max};
pub use contact::{ContactPairs, contact_candidates, contact_forces, contact_impulses};
pub use control_forces::{control_forces, control_forces_assemble};
pub use field_forces::field_forces;
pub use implicit::{
    Constraint, Constraints, ElementBlock, Elements, LinearSystem, Linearisation, Schwarz, Term,
    collider_constraints, constraint_impulses, constraint_release, contact_linearise,
    implicit_assemble, preconditioner_apply, spring_linearise, vector_combine, vector_dot,
};
pub use integrate_explicit::integrate_explicit;
pub use kernels::ReferenceKernels;
pub use matrix::Matrix;
pub use measure::{Figures, measure};
pub use membrane::{membrane_forces, membrane_linearise};
pub use number::Number;
pub use particles::Particles;
pub use procedural_forces::procedural_forces;
pub use semi_implicit::{Surplus, angular_surplus};
pub use spring_forces::{spring_force_on, spring_forces};
pub use strain_limit::strain_limit;
pub use stretch_limit::stretch_limit;
pub use surface::{Surface, surface_at, velocity_at};
pub use vector::Vector;
pub use vertex_normals::vertex_normals;

/// Its name.
const NAME: &str = "reference";

/// The plain loops, on one thread, in double precision.
#[derive(Clone)]
pub struct ReferenceBackend {
    info: BackendInfo,
}

impl ReferenceBackend {
    /// The backend.
    #[must_use]
    pub fn new() -> Self {
        let info = BackendInfo {
            name: NAME,
            device: "plain loops on one thread".into(),
            precisions: vec![Precision::F64],
            details: Vec::new(),
        };
        Self { info }
    }
}

impl Default for ReferenceBackend {
    fn default() -> Self {
        Self::new()
    }
}

impl Backend for ReferenceBackend {
    fn info(&self) -> &BackendInfo {
        &self.info
    }

    fn share(&self) -> Option<Box<dyn Backend>> {
        Some(Box::new(self.clone()))
    }

    fn create_solver(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Solver>> {
        let config = &config.resolved(&model, None);
        check(&model, config)?;
        Ok(Box::new(SteppedSolver::new(ReferenceKernels::new(model, config)?)?))
    }

    fn create_kernels(&self, model: Arc<Model>, config: &SolverConfig) -> Result<Box<dyn Kernels>> {
        Ok(Box::new(ReferenceKernels::new(model, config)?))
    }
}

/// The answer to who asks for something that it does not have.
fn unsupported<T>(feature: impl Into<String>) -> Result<T> {
    Err(Error::Unsupported { backend: NAME, feature: feature.into() })
}

/// Refuses settings that it does not have.
fn check(model: &Model, config: &SolverConfig) -> Result<()> {
    model.check_integrator(config, NAME)?;
    match &config.integrator {
        Integrator::Explicit => Ok(()),
        Integrator::Implicit(ImplicitSettings { linear, .. })
        | Integrator::Midpoint(MidpointSettings { linear, .. }) => match linear.method {
            LinearMethod::ConjugateGradient => check_preconditioner(linear.preconditioner),
            LinearMethod::Jacobi | LinearMethod::Direct => Ok(()),
            other => unsupported(format!("the linear solver {other}")),
        },
        Integrator::SemiImplicit(settings) => check_solve(settings.solve),
        other => unsupported(format!("the integrator {other:?}")),
    }
}

fn check_preconditioner(preconditioner: Preconditioner) -> Result<()> {
    match preconditioner {
        Preconditioner::Diagonal | Preconditioner::Block | Preconditioner::Schwarz => Ok(()),
        other => {
            unsupported(format!("the preconditioner {other} (it has diagonal, block and schwarz)"))
        }
    }
}

fn check_solve(solve: SemiImplicitSolve) -> Result<()> {
    match solve {
        SemiImplicitSolve::Factorisation => Ok(()),
        other => unsupported(format!("the {other} of the semi-implicit integrator")),
    }
}

fn check_precision(precision: Precision) -> Result<()> {
    match precision {
        Precision::F64 => Ok(()),
        Precision::F32 => unsupported("precision f32 (it has f64)"),
    }
}
