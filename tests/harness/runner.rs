//! Running a check on many generated cases.

use proptest::{
    strategy::Strategy,
    test_runner::{Config, RngSeed, TestCaseError, TestRunner},
};

use crate::{
    Verdict,
    backends::{Candidate, candidates},
};

/// Runs `check` on `count` cases for every candidate (fewer for a slow one), and reports the simplest one that fails.
///
/// A candidate that lacks what the check is about, as its list of missing features says, is let off; a line says so.
///
/// With `CLOTH_CANDIDATE` only candidates run whose label begins with its value.
///
/// The cases are the same on every run, so that a failure is always seen again;
/// `PROPTEST_RNG_SEED` gives other ones and `PROPTEST_CASES` more of them.
///
/// # Panics
/// If a case fails.
pub fn for_all<S: Strategy>(
    count: u32,
    strategy: &S,
    check: impl Fn(&Candidate, &S::Value) -> Verdict,
) {
    let wanted = std::env::var("CLOTH_CANDIDATE").unwrap_or_default();
    for candidate in candidates().iter().filter(|candidate| candidate.label.starts_with(&wanted)) {
        let mut config = Config { failure_persistence: None, ..Config::default() };
        if std::env::var_os("PROPTEST_CASES").is_none() {
            config.cases = count;
        }
        config.cases = config.cases.div_ceil(candidate.case_divisor);
        if config.rng_seed == RngSeed::Random {
            config.rng_seed = RngSeed::Fixed(1995);
        }
        let outcome = TestRunner::new(config).run(strategy, |case| {
            let _turn = candidate.turn();
            match check(candidate, &case) {
                Err(failure) if candidate.is_known_to_lack(&failure) => Ok(()),
                Err(failure) => Err(TestCaseError::fail(failure.to_string())),
                Ok(()) => Ok(()),
            }
        });
        if let Err(error) = outcome {
            panic!("{error}");
        }
    }
}
