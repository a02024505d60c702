//! The table of 2000: three integrators on small patches in steps of 20 ms, in frames per second, on a Pentium III
//! with 600 MHz; and its claim that stiffness can be raised by 10^5 if integration is implicit.
//!
//! Explicit integration limits the strain in ten sweeps, which the text calls iterations of inverse dynamics.

use cloth::{Backend, ImplicitSettings, Integrator, SemiImplicitSettings, StrainLimit};

use super::group;
use crate::case::{Case, CaseError};

/// Particles along a side, and frames per second of the explicit, the implicit and the semi-implicit integrator.
pub(crate) const PUBLISHED: [(u32, [f64; 3]); 3] =
    [(15, [142.0, 28.0, 90.0]), (25, [52.0, 6.0, 19.0]), (33, [30.0, 2.0, 7.0])];

/// Sweeps of the limit of strain.
const SWEEPS: u32 = 10;
/// Exponents of ten that stiffness is raised by.
const EXPONENT_MAX: i32 = 6;
/// Steps that have to go well.
const STEPS: usize = 200;

const NAMES: [&str; 3] = ["explicit", "implicit", "semi-implicit"];

fn integrator(number: usize) -> (Integrator, Option<StrainLimit>) {
    match number {
        0 => (Integrator::Explicit, Some(StrainLimit { sweeps: SWEEPS, ..StrainLimit::default() })),
        1 => (Integrator::Implicit(ImplicitSettings::default()), None),
        _ => (Integrator::SemiImplicit(SemiImplicitSettings::default()), None),
    }
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (side, published) in PUBLISHED {
        for (number, name) in NAMES.into_iter().enumerate() {
            let (integrator, limit) = integrator(number);
            let case = Case::curtain(group::TABLE_INTEGRATORS, side, 1.0, integrator, limit);
            cases.push(case.labelled(name).beside(Some(published[number])));
        }
    }
    cases
}

/// For each integrator, the largest power of ten by which stiffness can be raised without the simulation leaving the
/// range in which it means anything.
///
/// # Errors
/// If a model cannot be made, or a solver for it.
pub(crate) fn stiffness_bounds(
    backend: &dyn Backend,
) -> Result<[(&'static str, i32); 3], CaseError> {
    let mut bounds = NAMES.map(|name| (name, -1));
    for (number, bound) in bounds.iter_mut().enumerate() {
        for exponent in 0..=EXPONENT_MAX {
            let (integrator, limit) = integrator(number);
            let factor = 10.0_f64.powi(exponent);
            let case =
                Case::curtain(group::TABLE_STIFFNESS, PUBLISHED[0].0, factor, integrator, limit);
            if !is_stable(backend, &case)? {
                break;
            }
            bound.1 = exponent;
        }
    }
    Ok(bounds)
}

fn is_stable(backend: &dyn Backend, case: &Case) -> Result<bool, CaseError> {
    let mut solver = backend.create_solver(case.model()?, &case.config)?;
    for _ in 0..STEPS {
        solver.advance(case.frame)?;
        if let Err(error) = solver.synchronize() {
            return if matches!(error, cloth::Error::Diverged { .. }) {
                Ok(false)
            } else {
                Err(error.into())
            };
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_implicit_integration_bears_a_hundred_thousand_times_the_stiffness() {
        let cpu = cloth::backend_create("cpu", None).unwrap();
        let [explicit, implicit, semi_implicit] = stiffness_bounds(&*cpu).unwrap();
        assert!((0..3).contains(&explicit.1), "{explicit:?}");
        assert!(implicit.1 >= 5 && semi_implicit.1 >= 5, "{implicit:?} {semi_implicit:?}");
    }
}
