//! The same bits on any number of threads, on every run, and after a checkpoint.

use cloth_core::{Backend, ContactResponse, Precision};
use harness::{
    backends::{candidates, cpu},
    checks::{Scenario, resumes_with_same_bits, same_bits},
};

const IMPULSE: ContactResponse = ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };
const PENALTY: ContactResponse = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };

fn scenarios(side: u32) -> impl Iterator<Item = Scenario> {
    let precisions = [Precision::F32, Precision::F64];
    precisions.into_iter().flat_map(move |precision| {
        [IMPULSE, PENALTY].map(|response| Scenario { side, response, precision, substeps: 300 })
    })
}

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    let backends = [1, 2, 8].map(cpu);
    let backends = backends.each_ref().map(|backend| backend as &dyn Backend);
    for scenario in scenarios(48) {
        if let Err(failure) = same_bits(&backends, &scenario) {
            panic!("{failure}");
        }
    }
}

#[test]
fn running_twice_gives_the_same_bits() {
    for scenario in scenarios(24) {
        for candidate in candidates().iter().filter(|c| c.precision == scenario.precision) {
            let _turn = candidate.turn();
            let backend = &*candidate.backend;
            if let Err(failure) = same_bits(&[backend, backend], &scenario) {
                panic!("{}: {failure}", candidate.label);
            }
        }
    }
}

#[test]
fn a_continued_run_gives_the_same_bits() {
    for scenario in scenarios(24) {
        for candidate in candidates().iter().filter(|c| c.precision == scenario.precision) {
            let _turn = candidate.turn();
            if let Err(failure) = resumes_with_same_bits(&*candidate.backend, &scenario) {
                panic!("{}: {failure}", candidate.label);
            }
        }
    }
}
