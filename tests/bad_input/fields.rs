//! Expressions of forces that have no value.

use std::sync::Arc;

use cloth_core::{
    DivergenceCause, Error, Field, FieldProgram, Frame, Integrator, Model, SemiImplicitSettings,
    SolverConfig, State, StepReport,
};
use harness::backends::{Candidate, candidates};

use crate::builder;

fn model(expression: &str) -> Arc<Model> {
    let program = Arc::new(FieldProgram::compile(expression).unwrap());
    Arc::new(builder().gravity([0.0; 3]).field(Field::Procedural { program }).build().unwrap())
}

fn run(
    candidate: &Candidate,
    expression: &str,
    integrator: Integrator,
) -> (cloth_core::Result<StepReport>, State) {
    let config =
        SolverConfig { precision: candidate.precision, integrator, ..SolverConfig::default() };
    let mut solver = candidate.backend.create_solver(model(expression), &config).unwrap();
    solver.advance(Frame { duration: 0.1 }).unwrap();
    let report = solver.synchronize();
    let mut state = State::default();
    solver.download(&mut state).unwrap();
    (report, state)
}

/// Particle 4 of nine is in the middle, where x is zero.
#[test]
fn division_by_zero_is_divergence_and_names_the_particle() {
    for candidate in candidates() {
        let (report, _) = run(candidate, "m * x / dot(x, x)", Integrator::Explicit);
        let Err(Error::Diverged(divergence)) = report else { panic!("{report:?}") };
        assert_eq!(divergence.cause, DivergenceCause::NonFinite, "{}", candidate.label);
    }
}

/// Nine particles fill a packet only in part: what the expression makes of the rest is nobody's concern.
#[test]
fn what_select_leaves_out_does_no_harm() {
    for candidate in candidates() {
        let expression = "select(dot(x, x) > 1e-6, 1e-3 * m * x / dot(x, x), vec3(0, 0, m))";
        for integrator in
            [Integrator::Explicit, Integrator::SemiImplicit(SemiImplicitSettings::default())]
        {
            let (report, state) = run(candidate, expression, integrator);
            report.unwrap();
            assert!(state.positions[4][2] > 1e-6, "{}: the middle is lifted", candidate.label);
        }
    }
}

/// All particles alike, so that springs do nothing: the velocity is a sum that can be done by hand.
#[test]
fn an_expression_pulls_as_hard_as_it_says() {
    for candidate in candidates() {
        let all = "m * vec3(0.5 + t, 0, 0)";
        for integrator in
            [Integrator::Explicit, Integrator::SemiImplicit(SemiImplicitSettings::default())]
        {
            let (report, state) = run(candidate, all, integrator);
            report.unwrap();
            for velocity in &state.velocities {
                // The sum of (0.5 + t) h at the starts of 100 substeps of 1 ms.
                let wanted = 0.1 * 0.5 + 1e-6 * 4950.0;
                assert!((velocity[0] - wanted).abs() < 1e-5, "{}: {velocity:?}", candidate.label);
            }
        }
    }
}
