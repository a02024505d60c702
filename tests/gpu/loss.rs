//! A device that goes away, or has no memory left.

use cloth_core::{Backend, Error, Frame, Solver, State};

use crate::rig::{IMPULSE, advance, config, lowered, model};

#[test]
fn a_lost_device_is_an_error_from_then_on() {
    let backend = lowered(|_| {});
    let mut solver = backend.create_wgpu_solver(model(17, Some(IMPULSE)), &config()).unwrap();
    advance(&mut solver, 1);
    backend.device().destroy();
    let frame = Frame { duration: 3e-3 };
    let outcome = solver.advance(frame).and_then(|()| solver.synchronize().map(|_| ()));
    assert!(matches!(outcome, Err(Error::DeviceLost { backend: "wgpu", .. })), "{outcome:?}");
    let outcome = solver.download(&mut State::default());
    assert!(matches!(outcome, Err(Error::DeviceLost { .. })), "{outcome:?}");
    let outcome = backend.create_solver(model(5, None), &config()).map(|_| ());
    assert!(matches!(outcome, Err(Error::DeviceLost { .. })), "{outcome:?}");
}
