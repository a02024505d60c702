//! Settings of the solver.

use std::sync::Arc;

use cloth_core::{AdaptiveSettings, Error, ModelError, SolverConfig, StrainLimit, TimeStepControl};
use harness::backends::candidates;

use crate::builder;

fn with_limit(limit: StrainLimit) -> SolverConfig {
    SolverConfig { strain_limit: Some(limit), ..SolverConfig::default() }
}

fn adaptive(strain_max: f64, halvings_max: u32, grow_after: u32) -> SolverConfig {
    let settings =
        AdaptiveSettings { strain_max, halvings_max, grow_after, needs_convergence: true };
    SolverConfig {
        time_step_control: TimeStepControl::Adaptive(settings),
        ..SolverConfig::default()
    }
}

#[test]
fn every_setting_is_checked_by_every_backend() {
    let time_step = |time_step| SolverConfig { time_step, ..SolverConfig::default() };
    let strain_bound = |strain_bound| SolverConfig { strain_bound, ..SolverConfig::default() };
    let ratio = |ratio| with_limit(StrainLimit { ratio, ..StrainLimit::default() });
    let sweeps = with_limit(StrainLimit { sweeps: 0, ..StrainLimit::default() });
    let not_positive = |what: &str, value| ModelError::NotPositive { what: what.into(), value };
    let infinite = f64::INFINITY;
    let cases = [
        (time_step(0.0), not_positive("time step", 0.0)),
        (time_step(-1e-3), not_positive("time step", -1e-3)),
        (time_step(infinite), ModelError::NonFinite { what: "time step".into(), value: infinite }),
        (strain_bound(0.0), not_positive("strain bound", 0.0)),
        (
            ratio(0.9),
            ModelError::OutOfRange {
                what: "ratio of the strain limit".into(),
                value: 0.9,
                min: 1.0,
                max: 1e6,
            },
        ),
        (sweeps, not_positive("sweeps of the strain limit", 0.0)),
        (adaptive(0.0, 8, 4), not_positive("largest strain of the adaptive time step", 0.0)),
        (
            adaptive(0.5, 21, 4),
            ModelError::OutOfRange {
                what: "halvings of the adaptive time step".into(),
                value: 21.0,
                min: 0.0,
                max: 20.0,
            },
        ),
        (adaptive(0.5, 8, 0), not_positive("substeps before the adaptive time step grows", 0.0)),
    ];
    let model = Arc::new(builder().build().unwrap());
    for (config, expected) in cases {
        assert_eq!(config.validate(), Err(expected.clone()));
        for candidate in candidates() {
            let config = SolverConfig { precision: candidate.precision, ..config.clone() };
            let error = candidate.backend.create_solver(model.clone(), &config).err();
            assert_eq!(error, Some(Error::Invalid(expected.clone())), "{}", candidate.label);
        }
    }
    // NaN is not equal to itself.
    let error = time_step(f64::NAN).validate();
    assert!(matches!(error, Err(ModelError::NonFinite { .. })), "{error:?}");
}
