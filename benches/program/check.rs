//! Whether a solver does what the reference does.
//!
//! The reference is the CPU backend in double precision. Cloth that folds is chaotic, so that states of two
//! precisions part after some frames even if every step is right. Therefore both start from the same state,
//! that in which the measurement ended, and are compared after one frame.

use cloth::{Backend, Frame, Model, Precision, Solver, SolverConfig, State};

use std::sync::Arc;

use crate::{case::CaseError, record::Verdict};

/// Difference up to which a result is that of the reference, root of the mean square over all particles, in units of
/// the distance of neighbours. Rounding makes about a hundred-thousandth; a wrong force of a single kind many times more
/// than this.
const DIFFERENCE_MAX: f64 = 1e-3;

/// Lets both go on for a frame; the difference and what to say of it.
///
/// # Errors
/// What either reports.
pub(crate) fn check(
    reference: &dyn Backend,
    model: Arc<Model>,
    config: &SolverConfig,
    frame: Frame,
    solver: &mut dyn Solver,
    spacing: f64,
) -> Result<(f64, Verdict), CaseError> {
    let config = SolverConfig { precision: Precision::F64, threads: None, ..config.clone() };
    let mut state = State::default();
    solver.download(&mut state)?;
    let mut exact = reference.create_solver(model, &config)?;
    exact.upload(&state)?;
    // A solver that is given a state starts anew; the one that is checked has to do the same.
    solver.upload(&state)?;
    let results = [after_frame(solver, frame)?, after_frame(&mut *exact, frame)?];
    let difference = difference(&results) / spacing;
    let is_same = difference < DIFFERENCE_MAX;
    Ok((difference, if is_same { Verdict::Valid } else { Verdict::Invalid }))
}

fn after_frame(solver: &mut dyn Solver, frame: Frame) -> Result<State, CaseError> {
    solver.advance(frame)?;
    solver.synchronize()?;
    let mut state = State::default();
    solver.download(&mut state)?;
    Ok(state)
}

/// Root of the mean square of the distances \[m\].
fn difference([a, b]: &[State; 2]) -> f64 {
    let squares = a.positions.iter().zip(&b.positions);
    let sum: f64 = squares.map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>()).sum();
    (sum / a.positions.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    #[test]
    fn a_solver_with_another_time_step_is_not_the_reference() {
        let cpu = cloth::backend_create("cpu", None).unwrap();
        let case = Case::sphere("test", 20, true).unwrap();
        let model = case.model().unwrap();
        for (factor, expected) in [(1.0, Verdict::Valid), (17.0, Verdict::Invalid)] {
            let config =
                SolverConfig { time_step: factor * case.config.time_step, ..case.config.clone() };
            let mut solver = cpu.create_solver(model.clone(), &config).unwrap();
            for _ in 0..10 {
                solver.advance(case.frame).unwrap();
                solver.synchronize().unwrap();
            }
            let checked =
                check(&*cpu, model.clone(), &case.config, case.frame, &mut *solver, case.spacing());
            assert_eq!(checked.unwrap().1, expected);
        }
    }
}
