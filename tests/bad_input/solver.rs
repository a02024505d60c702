//! A solver refuses what does not fit, and goes on as if nothing had happened.

use std::sync::Arc;

use cloth_core::{Control, Error, Frame, ModelError, PinAction, PinControl, SolverConfig, State};
use harness::{backends::candidates, bits::first_difference};

use crate::builder;

#[test]
fn a_refused_input_changes_nothing() {
    let model = Arc::new(builder().build().unwrap());
    for candidate in candidates() {
        let config = SolverConfig { precision: candidate.precision, ..SolverConfig::default() };
        let mut solver = candidate.backend.create_solver(model.clone(), &config).unwrap();
        let [mut before, mut after] = [State::default(), State::default()];
        solver.advance(Frame::per_second(60.0)).unwrap();
        solver.synchronize().unwrap();
        solver.download(&mut before).unwrap();

        let error = solver.upload(&State::default());
        assert!(matches!(error, Err(Error::Invalid(ModelError::LengthMismatch { .. }))));
        let pin = PinControl { particle: 99, action: PinAction::Hold };
        let error = solver.set_control(&Control { pins: vec![pin], ..Control::default() });
        assert!(matches!(error, Err(Error::Invalid(ModelError::PinOutOfRange { pin: 99, .. }))));
        for duration in [0.0, -1.0] {
            let error = solver.advance(Frame { duration });
            assert!(matches!(error, Err(Error::Invalid(ModelError::NotPositive { .. }))));
        }
        let error = solver.advance(Frame { duration: f64::NAN });
        assert!(matches!(error, Err(Error::Invalid(ModelError::NonFinite { .. }))));

        solver.download(&mut after).unwrap();
        assert_eq!(first_difference(&before, &after), None, "{}", candidate.label);
        assert_eq!((before.time, before.step), (after.time, after.step));
    }
}
