//! All experiments on the CPU, with few cases.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

use std::time::Instant;

use cloth_backend_cpu::CpuBackend;
use cloth_core::Precision;
use cloth_laboratory::{
    EXPERIMENTS, Experiment, Flaw, Laboratory, Outcome, Thoroughness, page, table,
};

fn run(experiment: &Experiment, precision: Precision, flaw: Flaw) -> Outcome {
    let backend = CpuBackend::new(None).unwrap();
    let laboratory =
        Laboratory { backend: &backend, precision, thoroughness: Thoroughness::Quick, flaw };
    (experiment.run)(&laboratory).unwrap()
}

/// And each fails in some row with its flaw.
#[test]
fn experiments_pass_and_notice_their_flaws_and_the_page_shows_them() {
    let mut outcomes = Vec::new();
    for experiment in EXPERIMENTS {
        let start = Instant::now();
        let outcome = run(experiment, Precision::F64, Flaw::default());
        println!("{}  {:?}", table(experiment, &outcome), start.elapsed());
        let flawed = run(experiment, Precision::F64, experiment.control);
        let failed = |of: &Outcome| of.measurements.iter().filter(|row| !row.passes()).count();
        let [right, wrong] = [&outcome, &flawed].map(failed);
        assert!(wrong > right, "{}: {wrong} with the flaw, {right} without", experiment.name);
        outcomes.push((experiment, outcome));
    }
    let failing: Vec<_> = outcomes.iter().filter(|o| !o.1.passes()).map(|o| o.0.name).collect();
    assert_eq!(failing, [""; 0]);
    let page = page("this machine", &outcomes);
    assert!(EXPERIMENTS.iter().all(|e| page.contains(e.name)) && page.contains("<svg"));
}

#[test]
fn single_precision_is_enough() {
    for name in ["patch-test", "strip-biaxial", "hanging", "shear", "free-spin"] {
        let experiment = EXPERIMENTS.iter().find(|experiment| experiment.name == name).unwrap();
        let outcome = run(experiment, Precision::F32, Flaw::default());
        assert!(outcome.passes(), "{}", table(experiment, &outcome));
    }
}
