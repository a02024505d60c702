//! One size on more and more threads of the processor.

use cloth::{LinearMethod, Preconditioner};
use cloth_benches::HangWorkload;

use super::{group, workloads::implicit};
use crate::{
    arguments::Suite,
    case::{Case, CaseError},
    engine::Engine,
};

/// Particles along a side.
const SIDE: u32 = 256;

pub(super) fn cases(suite: Suite, engine: &Engine) -> Result<Vec<Case>, CaseError> {
    let mut cases = Vec::new();
    if engine.is_asynchronous() || suite == Suite::Quick {
        return Ok(cases);
    }
    for threads in thread_counts(std::thread::available_parallelism().map_or(1, usize::from)) {
        for (label, contact) in [("explicit", false), ("explicit with self-contact", true)] {
            let case = Case::sphere(group::SCALING, SIDE, contact)?;
            cases.push(case.labelled(label).on_threads(threads));
        }
        let integrator = implicit(LinearMethod::ConjugateGradient, Preconditioner::Diagonal, 30);
        let case = Case::hang(group::SCALING, HangWorkload::new(SIDE), integrator);
        cases.push(case.labelled("implicit").on_threads(threads));
    }
    Ok(cases)
}

/// Powers of two up to all threads, and all of them.
fn thread_counts(all: usize) -> Vec<usize> {
    let mut counts: Vec<usize> =
        std::iter::successors(Some(1), |count| Some(2 * count)).take_while(|&c| c < all).collect();
    counts.push(all);
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_threads_are_the_last_count() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(6), [1, 2, 4, 6]);
        assert_eq!(thread_counts(8), [1, 2, 4, 8]);
    }
}
