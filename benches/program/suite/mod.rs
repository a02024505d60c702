//! What is measured, in groups that each make a table or a plot.

mod integrators;
pub(crate) mod ladder;
mod linear;
mod residual;
mod scaling;
mod workloads;

pub(crate) use integrators::{PUBLISHED as INTEGRATORS_PUBLISHED, stiffness_bounds};

use crate::{
    arguments::Suite,
    case::{Case, CaseError},
    engine::Engine,
};

/// Names of the groups, as results have them.
pub(crate) mod group {
    /// Frames of the patch that falls onto a sphere, explicit.
    pub(crate) const EXPLICIT: &str = "explicit";
    /// The same with self-contact.
    pub(crate) const CONTACT: &str = "explicit with self-contact";
    /// Steps of the patch that hangs, conjugate gradients.
    pub(crate) const IMPLICIT: &str = "implicit, conjugate gradients";
    /// The same with Jacobi.
    pub(crate) const JACOBI: &str = "implicit, Jacobi";
    /// The same with the semi-implicit integrator.
    pub(crate) const SEMI_IMPLICIT: &str = "semi-implicit";
    /// One size, more and more threads.
    pub(crate) const SCALING: &str = "threads";
    /// One size, more and more iterations.
    pub(crate) const RESIDUAL: &str = "residual";
    /// Published table of 2000.
    pub(crate) const TABLE_INTEGRATORS: &str = "table of integrators";
    /// How far stiffness can be raised.
    pub(crate) const TABLE_STIFFNESS: &str = "table of stiffness";
    /// Published table of 2006.
    pub(crate) const TABLE_LINEAR: &str = "table of linear solvers";
    /// Published table of 2025.
    pub(crate) const TABLE_LADDER: &str = "table of the ladder";
}

/// The cases for one engine. A GPU that is played by the processor gets few and small ones.
///
/// # Errors
/// If a workload is not valid, which its tests exclude.
pub(crate) fn cases(suite: Suite, engine: &Engine) -> Result<Vec<Case>, CaseError> {
    let mut cases = Vec::new();
    if suite == Suite::Linear {
        return Ok(cases);
    }
    if suite != Suite::Tables {
        cases.extend(workloads::cases(suite, engine)?);
        cases.extend(scaling::cases(suite, engine)?);
        cases.extend(residual::cases(suite, engine));
    }
    if suite != Suite::Quick {
        cases.extend(integrators::cases());
        cases.extend(linear::cases(engine));
    }
    Ok(cases)
}
