//! The same bits on any number of threads, on every run, and after a checkpoint.

use cloth_core::{
    Backend, ContactResponse, ImplicitSettings, Integrator, LinearMethod, NewtonSettings, Precision,
};
use harness::{
    backends::{candidates, cpu},
    checks::{Scenario, resumes_with_same_bits, same_bits},
    linear::LINEAR_METHODS,
};

const IMPULSE: ContactResponse = ContactResponse::Impulse { restitution: 0.1, friction: 0.3 };
const PENALTY: ContactResponse = ContactResponse::Penalty { stiffness: 30.0, damping: 0.01 };

/// Explicit steps with and without a limit of strain, which not every fused form has; linearised steps with each linear solver, and
/// Newton's method, all from the answer of the substep before.
fn integrators() -> Vec<(Integrator, u32, bool)> {
    let mut all = vec![(Integrator::Explicit, 120, false), (Integrator::Explicit, 120, true)];
    for &method in LINEAR_METHODS {
        let mut settings = ImplicitSettings::default();
        settings.linear.method = method;
        settings.linear.warm_start = true;
        settings.linear.iterations_max = 40;
        if method == LinearMethod::ConjugateGradient {
            settings.newton = NewtonSettings { iterations_max: 2, ..NewtonSettings::default() };
        }
        all.push((Integrator::Implicit(settings), 12, true));
    }
    all
}

fn scenarios(side: u32) -> impl Iterator<Item = Scenario> {
    let precisions = [Precision::F32, Precision::F64];
    precisions.into_iter().flat_map(move |precision| {
        [IMPULSE, PENALTY].into_iter().flat_map(move |response| {
            integrators().into_iter().map(move |(integrator, substeps, strain_limit)| Scenario {
                side,
                response,
                precision,
                substeps,
                integrator,
                strain_limit,
            })
        })
    })
}

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    let backends = [1, 2, 8].map(cpu);
    let backends = backends.each_ref().map(|backend| backend as &dyn Backend);
    for scenario in scenarios(24) {
        if let Err(failure) = same_bits(&backends, &scenario) {
            panic!("{failure}");
        }
    }
}

#[test]
fn running_twice_gives_the_same_bits() {
    for scenario in scenarios(16) {
        for candidate in candidates().iter().filter(|c| c.precision == scenario.precision) {
            let _turn = candidate.turn();
            let backend = &*candidate.backend;
            match same_bits(&[backend, backend], &scenario) {
                Err(failure) if candidate.is_known_to_lack(&failure) => {}
                Err(failure) => panic!("{}: {failure}", candidate.label),
                Ok(()) => {}
            }
        }
    }
}

#[test]
fn a_continued_run_gives_the_same_bits() {
    for scenario in scenarios(16) {
        for candidate in candidates().iter().filter(|c| c.precision == scenario.precision) {
            let _turn = candidate.turn();
            match resumes_with_same_bits(&*candidate.backend, &scenario) {
                Err(failure) if candidate.is_known_to_lack(&failure) => {}
                Err(failure) => panic!("{}: {failure}", candidate.label),
                Ok(()) => {}
            }
        }
    }
}
