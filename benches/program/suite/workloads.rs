//! The common workloads from small to large: the plot of time against particles.

use cloth::{
    ImplicitSettings, Integrator, LinearMethod, LinearSettings, Preconditioner,
    SemiImplicitSettings,
};
use cloth_benches::HangWorkload;

use super::group;
use crate::{
    arguments::Suite,
    case::{Case, CaseError},
    engine::Engine,
};

/// Iterations of every implicit step.
const ITERATIONS: u32 = 30;
/// Window of frames in the quick suite: the patch has reached the sphere.
const FRAMES_QUICK: [usize; 2] = [10, 20];
/// Particles along a side up to which a constant matrix is factorised.
const SIDE_FACTORISED: u32 = 256;

pub(super) fn cases(suite: Suite, engine: &Engine) -> Result<Vec<Case>, CaseError> {
    let mut cases = Vec::new();
    for side in explicit_sides(suite, engine) {
        for (group, contact) in [(group::EXPLICIT, false), (group::CONTACT, true)] {
            let case = Case::sphere(group, side, contact)?;
            cases.push(if suite == Suite::Quick { case.over(FRAMES_QUICK) } else { case });
        }
    }
    for side in implicit_sides(suite, engine) {
        for (group, method) in [
            (group::IMPLICIT, LinearMethod::ConjugateGradient),
            (group::JACOBI, LinearMethod::Jacobi),
        ] {
            let integrator = implicit(method, Preconditioner::Diagonal, ITERATIONS);
            cases.push(Case::hang(group, HangWorkload::new(side), integrator));
        }
        if side <= SIDE_FACTORISED {
            let integrator = Integrator::SemiImplicit(SemiImplicitSettings::default());
            cases.push(Case::hang(group::SEMI_IMPLICIT, HangWorkload::new(side), integrator));
        }
    }
    Ok(cases)
}

/// All of so many iterations.
pub(super) fn implicit(
    method: LinearMethod,
    preconditioner: Preconditioner,
    count: u32,
) -> Integrator {
    let linear = LinearSettings {
        method,
        preconditioner,
        tolerance: 0.0,
        iterations_max: count,
        ..LinearSettings::default()
    };
    Integrator::Implicit(ImplicitSettings { linear, ..ImplicitSettings::default() })
}

fn explicit_sides(suite: Suite, engine: &Engine) -> Vec<u32> {
    if engine.is_emulated() {
        return vec![32, 64];
    }
    let mut sides = match suite {
        Suite::Quick => vec![64, 160, 256],
        _ => vec![32, 64, 160, 256, 512, 1024],
    };
    if engine.is_asynchronous() {
        sides.push(if suite == Suite::Quick { 1024 } else { 2048 });
    }
    sides
}

fn implicit_sides(suite: Suite, engine: &Engine) -> Vec<u32> {
    match suite {
        _ if engine.is_emulated() => vec![32],
        Suite::Quick => vec![60, 160],
        _ => vec![33, 60, 160, 256, 512, 1024],
    }
}
