//! What residual a linear solver reaches in what time: one step with more and more iterations.

use cloth::{LinearMethod, Preconditioner};
use cloth_benches::HangWorkload;

use super::{group, workloads::implicit};
use crate::{arguments::Suite, case::Case, engine::Engine};

/// Iterations of the steps.
const ITERATIONS: [u32; 7] = [5, 10, 20, 40, 80, 160, 320];
/// Iterations in the quick suite.
const ITERATIONS_QUICK: [u32; 4] = [5, 20, 80, 160];
/// Steps before those that are timed, and timed.
const FRAMES: [usize; 2] = [3, 5];

pub(super) fn cases(suite: Suite, engine: &Engine) -> Vec<Case> {
    let (side, counts) = match suite {
        _ if engine.is_emulated() => (32, &ITERATIONS_QUICK[..]),
        Suite::Quick => (60, &ITERATIONS_QUICK[..]),
        _ => (160, &ITERATIONS[..]),
    };
    let methods = [
        ("diagonal", LinearMethod::ConjugateGradient, Preconditioner::Diagonal),
        ("block", LinearMethod::ConjugateGradient, Preconditioner::Block),
        (
            "incomplete Cholesky",
            LinearMethod::ConjugateGradient,
            Preconditioner::IncompleteCholesky,
        ),
        ("Schwarz", LinearMethod::ConjugateGradient, Preconditioner::Schwarz),
        ("Jacobi", LinearMethod::Jacobi, Preconditioner::Block),
    ];
    let mut cases = Vec::new();
    for (label, method, preconditioner) in methods {
        let is_of_processors = preconditioner == Preconditioner::IncompleteCholesky;
        if is_of_processors && engine.is_asynchronous() {
            // Triangular solves are for processors.
            continue;
        }
        for &count in counts {
            let integrator = implicit(method, preconditioner, count);
            let case = Case::hang(group::RESIDUAL, HangWorkload::new(side), integrator);
            cases.push(case.labelled(label).over(FRAMES));
        }
    }
    cases
}
