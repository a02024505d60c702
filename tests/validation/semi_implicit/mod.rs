//! The semi-implicit integrator: its constant system, what it conserves, how it moves.

mod conservation;
mod factorisations;
mod limits;
mod motion;
mod system;

use cloth_core::{Integrator, SemiImplicitSettings, SemiImplicitSolve};

pub(crate) const SEMI_IMPLICIT: Integrator =
    Integrator::SemiImplicit(SemiImplicitSettings { solve: SemiImplicitSolve::Factorisation });
