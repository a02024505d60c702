//! When the constant matrix is factorised, as the report counts it.

use cloth_core::{
    Control, Frame, GridPatch, ModelBuilder, PinAction, PinControl, Solver, SolverReport,
};
use harness::{
    backends::candidates_with,
    feature::Feature,
    models::{grid_cloth, material},
};

use super::SEMI_IMPLICIT;
use crate::rig::{build, download, solver_of};

const TIME_STEP: f64 = 0.01;

fn frame(solver: &mut dyn Solver, steps: f64) -> SolverReport {
    solver.advance(Frame { duration: steps * TIME_STEP }).unwrap();
    solver.synchronize().unwrap().solver
}

fn pin(solver: &mut dyn Solver, action: PinAction) {
    let pins = vec![PinControl { particle: 7, action }];
    solver.set_control(&Control { pins, ..Control::default() }).unwrap();
}

#[test]
fn a_new_length_or_pin_factorises_and_nothing_else() {
    let patch = GridPatch::horizontal(6, 0.05, 0.0);
    let model =
        build(ModelBuilder::new().cloth(grid_cloth("patch", patch, material(1e-3, 5.0, 1e-3))));
    for candidate in candidates_with(Feature::Factorisation) {
        let mut solver = solver_of(candidate, &model, TIME_STEP, SEMI_IMPLICIT);
        let solver = &mut *solver;
        let report = frame(solver, 2.5);
        assert_eq!([report.solves, report.factorisations], [3, 2], "two lengths");
        assert_eq!(frame(solver, 2.5).factorisations, 0, "the same two lengths");
        assert_eq!(frame(solver, 3.0).factorisations, 0, "one of them");
        assert_eq!(frame(solver, 1.25).factorisations, 1, "a third length");
        pin(solver, PinAction::Hold);
        assert_eq!(frame(solver, 2.0).factorisations, 1, "a particle is held");
        pin(solver, PinAction::MoveTo([0.1, 0.2, 0.3]));
        assert_eq!(frame(solver, 2.0).factorisations, 0, "it moves, and is held as before");
        let state = download(solver);
        assert!((state.positions[7][2] - 0.3).abs() < 1e-7, "the pin is on its target");
        solver.upload(&state).unwrap();
        assert_eq!(frame(solver, 2.0).factorisations, 0, "the same particles held");
        pin(solver, PinAction::Release);
        assert_eq!(frame(solver, 2.0).factorisations, 1, "a particle is released");
    }
}
